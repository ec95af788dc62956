//! The bits of every row's picture, and that they depend on the row alone.

use sha2::{Digest, Sha256};

use voxsplat::task::engines::EngineKind;

use crate::drawing::{Drawn, ENGINES, Picture, table};

/// Where the bits are to be written.
const FILE: &str = "VOXSPLAT_TABLE_BITS";

/// 64 bits of a hash, as hexadecimal digits.
fn hash(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().take(8).map(|byte| format!("{byte:02x}")).collect()
}

/// Size, light and shown bytes of a picture, or why there is none.
fn bits(outcome: &Result<Picture, String>) -> String {
    match outcome {
        Ok(Picture { size: [width, height], light, shown, .. }) => {
            let light: Vec<u8> = light.iter().flatten().flat_map(|c| c.to_le_bytes()).collect();
            format!("{width}x{height} light {} shown {}", hash(&light), hash(shown))
        }
        Err(refusal) => format!("refused: {refusal}"),
    }
}

/// One line a row, for `scripts/compare-bits.sh`: of the GPU engine.
#[test]
fn bits_are_written_where_they_are_asked_for() {
    let Some(path) = std::env::var_os(FILE) else { return };
    let table = table();
    let Some(adapter) = &table.adapter else { return };
    let line = |drawn: &Drawn| {
        let outcome = drawn.by(EngineKind::Gpu)?;
        Some(format!("{}: {}\n", drawn.row.name(), bits(outcome)))
    };
    let lines: String = table.rows.iter().filter_map(line).collect();
    std::fs::write(path, format!("# {adapter}\n{lines}")).expect("a file to write to");
}

#[test]
fn bits_do_not_depend_on_what_was_drawn_before() {
    let table = table();
    for engine in ENGINES {
        // The other way round.
        let again = table.rows.iter().rev().filter_map(|drawn| {
            let (row, first) = (&drawn.row, bits(drawn.by(engine)?));
            let again = bits(&table.draw(engine, row, &drawn.scene)?);
            (first != again).then(|| format!("{}: {first}, then {again}", row.name()))
        });
        let changed: Vec<String> = again.collect();
        assert!(changed.is_empty(), "by {}:\n{}", engine.name(), changed.join("\n"));
    }
}
