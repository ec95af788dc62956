//! What the papers show, drawn by this program: `cargo run --release --example reproductions`.
//!
//! Writes `docs/reproductions.md` and the pictures under `docs/reproductions/`. Every figure on the
//! page is measured in the run that writes it. Scans are those of `VOXSPLAT_DATA` (default
//! `../shared/data`); pictures are of volumes made in code, and of neghip and the blunt fin, whose licences allow it (VTK's
//! data, BSD 3-Clause).
//!
//! `… --example reproductions -- laur` draws the parts whose names begin so: their text goes to
//! stdout and their pictures to their place, and the page stays as it is.

mod classification;
mod crawfis_max;
mod growth;
mod jang;
mod laur_hanrahan;
mod modes;
mod support;
mod vectors;
mod westover;

use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Instant, SystemTime, UNIX_EPOCH};

use anyhow::{Context, Result, ensure};
use voxsplat::scene::SampleSource;
use voxsplat::task::still::Refine;

use support::Page;

/// A part of the page.
type Part<'a> = dyn Fn(&mut Page<'_>) -> Result<()> + 'a;

fn main() -> Result<()> {
    let data =
        std::env::var_os("VOXSPLAT_DATA").map_or(PathBuf::from("../shared/data"), PathBuf::from);
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs");
    let pictures = docs.join("reproductions");
    fs::create_dir_all(&pictures).with_context(|| format!("cannot make {}", pictures.display()))?;
    let mut page = Page::new(&pictures);
    let scan = |page: &mut Page<'_>| westover::write_scan(page, &data);
    let hierarchy = |page: &mut Page<'_>| laur_hanrahan::write(page, &data);
    let winds = |page: &mut Page<'_>| vectors::write(page, &data);
    let functions = |page: &mut Page<'_>| jang::write(page, &data);
    let parts: [(&str, &Part<'_>); 9] = [
        ("visibility modes", &modes::write),
        ("classification", &classification::write),
        ("Crawfis–Max", &crawfis_max::write),
        ("vectors", &winds),
        ("Laur–Hanrahan", &hierarchy),
        ("Jang", &functions),
        ("growth of cost", &growth::write),
        ("Westover", &westover::write),
        ("Westover on a patient's scan", &scan),
    ];
    let asked: Vec<String> = std::env::args().skip(1).map(|name| name.to_lowercase()).collect();
    if !asked.is_empty() {
        return some(&mut page, &parts, &asked);
    }
    heading(&mut page)?;
    let path = docs.join("reproductions.md");
    let start = Instant::now();
    for (done, (name, write)) in parts.iter().enumerate() {
        write(&mut page).with_context(|| (*name).to_owned())?;
        eprintln!("{name}: done after {:.0} s", start.elapsed().as_secs_f64());
        // After every part: what is measured is not lost to a later one, and what is not there yet
        // is named.
        let missing: Vec<&str> = parts[done + 1..].iter().map(|part| part.0).collect();
        let mut text = page.text.trim_end().to_owned();
        if !missing.is_empty() {
            text += "\n\n**This page is not complete.** The run that wrote it had still to draw: ";
            text += &missing.join(", ");
            text.push('.');
        }
        fs::write(&path, text + "\n")
            .with_context(|| format!("cannot write {}", path.display()))?;
    }
    println!("written: {}", path.display());
    Ok(())
}

/// The parts whose names begin with one of those asked for, to stdout.
fn some(page: &mut Page<'_>, parts: &[(&str, &Part<'_>)], asked: &[String]) -> Result<()> {
    let names: Vec<&str> = parts.iter().map(|part| part.0).collect();
    for name in asked {
        let known = names.iter().any(|part| part.to_lowercase().starts_with(name));
        ensure!(
            known,
            "expected the beginning of a part's name, found {name}; there are {names:?}"
        );
    }
    for (name, write) in parts {
        if asked.iter().any(|asked| name.to_lowercase().starts_with(asked)) {
            write(page).with_context(|| (*name).to_owned())?;
        }
    }
    println!("{}", page.text.trim_end());
    Ok(())
}

fn heading(page: &mut Page<'_>) -> Result<()> {
    let grid = support::demo_grid("blobs", 16)?;
    let source = SampleSource::default();
    let scene = voxsplat::scene::opening(source, support::scalar(&grid)?, grid.space.as_deref());
    let adapter = page.draw(&scene, 16, Refine::Full, 0)?.adapter;
    let cores = std::thread::available_parallelism().map_or(0, usize::from);
    let load = sysinfo::System::load_average().map_or(0.0, |load| load.one);
    page.say("# Reproductions");
    page.say(&format!(
        "What the papers show, drawn by this program. Written by `cargo run --release --example \
         reproductions` on {}, with the adapter {adapter}, {cores} processor cores; every figure not \
         marked as printed or as the study's was measured in that run.",
        today(),
    ));
    page.say(&format!(
        "Times are wall times from camera set to queue finished, on a machine that also did other \
         work (load {load:.1} at the start): each is the least of several frames, and may still be too long. \
         Errors are deterministic. dB is PSNR, −20 log₁₀ of the RMSE over all pixels and RGB, linear light, \
         black behind.",
    ));
    Ok(())
}

/// The date, UTC, as year-month-day.
fn today() -> String {
    let days = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |d| d.as_secs() / 86_400);
    let (mut year, mut left) = (1970, days);
    let leap = |y: u64| y.is_multiple_of(4) && (!y.is_multiple_of(100) || y.is_multiple_of(400));
    let length = |y| 365 + u64::from(leap(y));
    while left >= length(year) {
        left -= length(year);
        year += 1;
    }
    let february = 28 + u64::from(leap(year));
    let mut month = 1;
    for days in [31, february, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31] {
        if left < days {
            break;
        }
        left -= days;
        month += 1;
    }
    format!("{year}-{month:02}-{:02}", left + 1)
}
