//! Every row by the GPU engine at 128 × 128 pixels, whatever size and engine it is judged at.

use voxsplat::gpu::{GpuError, Renderer};
use voxsplat::task::draw::Drawer;

use crate::drawing::{context, draw};
use crate::rows::{Judged, Row, rows};

const SIZE: [u32; 2] = [128, 128];
/// One row in so many is drawn, unless all are asked for.
const SHARE: usize = 8;
/// Has all of them drawn where it is set.
const ALL: &str = "VOXSPLAT_TABLE_ALL";
/// The most rows that may be refused as the adapter ends loops: one in so many.
const MOST_REFUSED: usize = 20;

/// Rows whose loops software adapters end: after 65 535 turns of an invocation's loops together.
const ENDED: [&str; 0] = [];

#[test]
fn every_row_is_drawn_at_128() {
    let Some(context) = context() else { return };
    let mut drawer = Drawer::new(Renderer::new(context));
    let rows: Vec<Row> = rows().into_iter().filter(|r| r.judged != Judged::Refused).collect();
    assert!(ENDED.len() * MOST_REFUSED <= rows.len(), "{} of {}", ENDED.len(), rows.len());
    let gone: Vec<_> =
        ENDED.iter().filter(|name| !rows.iter().any(|row| row.name() == **name)).collect();
    assert!(gone.is_empty(), "no rows: {gone:?}");
    let share = if std::env::var_os(ALL).is_some() { 1 } else { SHARE };
    let mut faults = Vec::new();
    for row in rows.iter().step_by(share) {
        let (name, scene) = (row.name(), row.scene());
        let may_end = ENDED.contains(&&*name);
        match draw(&mut drawer, &Row { size: SIZE, ..row.clone() }, &scene) {
            Ok(picture) if picture.light.iter().flatten().all(|v| v.is_finite()) => {}
            Ok(_) => faults.push(format!("{name}: not finite")),
            Err(refused) if may_end && refused == GpuError::EndedLoops.to_string() => {}
            Err(refused) => faults.push(format!("{name}: {refused}")),
        }
    }
    let left = rows.len() - rows.len().div_ceil(share);
    if left > 0 {
        println!("skipped {left} of {} rows at 128 × 128 (set {ALL} to draw them)", rows.len());
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}
