use std::sync::Arc;
use voxsplat::{core::*, gpu::*, kernel::Kernel, scene::*, task::draw::*, transfer::*, volume::*};
fn psnr(a: &[[f32;4]], b: &[[f32;4]]) -> f64 { let mut s=0.0; for (x,y) in a.iter().zip(b) { for c in 0..3 { s += ((x[c]-y[c]) as f64).powi(2); } } -10.0*(s/(a.len() as f64*3.0)).log10() }
fn upsample(a:&[[f32;4]], s:[u32;2], t:[u32;2])->Vec<[f32;4]> { let mut out=Vec::new(); for y in 0..t[1] { for x in 0..t[0] { let fx=(x as f32+0.5)*s[0] as f32/t[0] as f32-0.5; let fy=(y as f32+0.5)*s[1] as f32/t[1] as f32-0.5; let g=|x:i32,y:i32| a[(y.clamp(0,s[1] as i32-1)*s[0] as i32+x.clamp(0,s[0] as i32-1)) as usize]; let (x0,y0)=(fx.floor() as i32,fy.floor() as i32); let (u,v)=(fx-x0 as f32, fy-y0 as f32); let mut p=[0.0;4]; for c in 0..4 { p[c]=(g(x0,y0)[c]*(1.0-u)+g(x0+1,y0)[c]*u)*(1.0-v)+(g(x0,y0+1)[c]*(1.0-u)+g(x0+1,y0+1)[c]*u)*v; } out.push(p); } } out }
fn cpu() -> f64 { let t=std::fs::read_to_string("/proc/self/stat").unwrap(); let f: Vec<&str>=t[t.rfind(')').unwrap()..].split(' ').collect(); (f[12].parse::<f64>().unwrap()+f[13].parse::<f64>().unwrap())*10.0 }
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let bytes = std::fs::read(&a[1]).unwrap();
    let dims: Vec<usize> = a[2].split(',').map(|v| v.parse().unwrap()).collect();
    let dims=[dims[0],dims[1],dims[2]];
    let pts: Vec<(f64,f64)> = a[3].split(',').map(|p| { let (x,y)=p.split_once(':').unwrap(); (x.parse().unwrap(), y.parse().unwrap()) }).collect();
    let size: Vec<u32> = a[4].split(',').map(|v| v.parse().unwrap()).collect(); let size=[size[0],size[1]];
    let t=std::time::Instant::now();
    let v = Arc::new(ScalarVolume::from_samples("x", Lattice::unit(dims), Samples::UInt8(bytes)).unwrap());
    println!("stats+bricks {:.1} ms", t.elapsed().as_secs_f64()*1e3);
    let scene = Scene { volume: v.clone(), transfer: TransferFunction { opacity: pts, colour: ColourSource::Stops(vec![(0.0,Srgb8([20,20,80])),(100.0,Srgb8([200,80,40])),(255.0,Srgb8::WHITE)]) }, splat: SplatSettings::default(), camera: framing_camera(&v.lattice, glam::DVec3::new(0.3,0.5,-0.8), glam::DVec3::Y), background: Background::Colour(Srgb8::BLACK) };
    let ctx = Context::new(&AdapterChoice::Auto, Wishes { float32_blending: std::env::var("F16").is_err(), timestamps: true }).unwrap();
    println!("{} {:?}", ctx.adapter_name, ctx.granted);
    let mut d = Drawer::new(Renderer::new(ctx));
    let t=std::time::Instant::now(); d.prepare(&scene, &Ticket::new()).unwrap();
    println!("prepare {:.1} ms; active {} hierarchy MB {:.1}", t.elapsed().as_secs_f64()*1e3, d.active_count(), d.hierarchy_bytes() as f64/1e6);
    let mut s2=scene.clone(); s2.transfer.opacity[1].1 += 1e-9; let t=std::time::Instant::now(); d.prepare(&s2, &Ticket::new()).unwrap(); println!("re-prepare {:.1}", t.elapsed().as_secs_f64()*1e3);
    let mut full=vec![];
    for _ in 0..2 { let c=cpu(); let r = d.draw(&scene, size, Rung::Full, &mut ()).unwrap(); println!("full n={} wall {:.0} cpu/2 {:.0}", r.kernels, r.wall_ms, (cpu()-c)/2.0); }
    full = d.renderer.read_light().unwrap();
    let t=std::time::Instant::now(); let px = d.renderer.present(Some(LinearRgb::default())).unwrap(); println!("present {:.1}", t.elapsed().as_secs_f64()*1e3);
    image::save_buffer("/tmp/full.png", &px, size[0], size[1], image::ColorType::Rgba8).unwrap();
<<<<<<< HEAD
    d.renderer.time_passes().unwrap(); d.draw(&scene, size, Rung::Full, &mut ()).unwrap(); println!("{:?}", d.renderer.times()); d.renderer.stop_timing();
=======
    d.renderer.time_passes().unwrap(); d.draw(&scene, size, Rung::Full, &mut ()).unwrap(); println!("{:?}", d.renderer.times());
>>>>>>> pack
    if std::env::var("FULL").is_ok() { return; } for e in [0.2f32,0.15,0.1,0.07,0.05,0.03,0.02,0.01] { let r = d.draw(&scene, size, Rung::Octree{max_error:e}, &mut ()).unwrap(); let l=d.renderer.read_light().unwrap(); println!("octree {e} n={} {:.1} ms {:.2} dB", r.kernels, r.wall_ms, psnr(&l,&full)); 
     if e==0.05 { let px = d.renderer.present(Some(LinearRgb::default())).unwrap(); image::save_buffer("/tmp/oct.png", &px, size[0], size[1], image::ColorType::Rgba8).unwrap(); } }
    for e in [0.1f32;0] { for k in [1u32,2,3,4,6] { let sz=[size[0]/k,size[1]/k]; let mut b=1e9f64; let mut n=0; for _ in 0..4 { let r=d.draw(&scene, sz, Rung::Octree{max_error:e}, &mut ()).unwrap(); b=b.min(r.wall_ms); n=r.kernels; } let l=d.renderer.read_light().unwrap(); let u=upsample(&l, sz, size); print!(" | e{e} /{k} n={n} {b:.1} ms {:.2}", psnr(&u,&full)); } println!(); }
    for level in [3,2,1] { let r = d.draw(&scene, size, Rung::Subsampled{level}, &mut ()).unwrap(); let l=d.renderer.read_light().unwrap(); println!("sub {level} n={} {:.1} ms {:.2} dB", r.kernels, r.wall_ms, psnr(&l,&full)); }
    for b in [8.0,16.0,24.0,33.0,60.0] { let mut r=None; for _ in 0..8 { r = Some(d.draw(&scene, size, Rung::Coarse{budget_ms:b}, &mut ()).unwrap()); } let r=r.unwrap(); let l=d.renderer.read_light().unwrap(); let u=upsample(&l, r.size, size); println!("coarse {b}: {:?} n={} e={} {:.1} ms {:.2} dB", r.size, r.kernels, r.max_error, r.wall_ms, psnr(&u,&full));
     let px = d.renderer.present(Some(LinearRgb::default())).unwrap(); image::save_buffer(format!("/tmp/coarse{b}.png"), &px, r.size[0], r.size[1], image::ColorType::Rgba8).unwrap(); }
}
