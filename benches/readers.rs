//! What readers take beside reading the bytes: `cargo bench --bench readers [-- FOLDER]`.
//!
//! 512³ samples of 16 bits (256 MiB) are written to FOLDER (a temporary one by default) in each format, and opened three
//! times, the best of which counts: beside `cat` (or `zcat`), and beside reading all files into memory as they are. The most memory that opening
//! takes is that of the process (Linux's `VmHWM`), less what it had before. Then 2 GiB are opened and cancelled at five
//! moments. Prints Markdown. Linux only. Everything lies in the system's cache of files.

#[path = "support/volumes.rs"]
mod volumes;
#[path = "../tests/io_files/write_dicom.rs"]
mod write_dicom;

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use voxsplat::core::Ticket;
use voxsplat::io::{OpenOptions, open};

use volumes::{BYTES, Written};

/// Each is opened so often.
const RUNS: usize = 3;
/// When a file of 2 GiB is cancelled, milliseconds after it began.
const CANCELS_MS: [u64; 5] = [1, 20, 100, 300, 500];

fn main() {
    let temporary = tempfile::tempdir().expect("a temporary folder");
    let named = std::env::args().skip(1).find(|arg| !arg.starts_with("--"));
    let folder = named.map_or(temporary.path().to_owned(), Into::into);
    println!(
        "| format | opened, ms | read into memory, ms | `cat` or `zcat`, ms | throughput by these, % | memory, × samples |"
    );
    println!("|---|---|---|---|---|---|");
    for write in volumes::ALL {
        let written = write(&folder).expect("the folder has room");
        let row = of_file(&written);
        println!("{row}");
        remove(&written.opened);
    }
    let beside = volumes::of_hdf5(&folder);
    for written in &beside {
        println!("{}", of_file(written));
    }
    if beside.is_empty() {
        println!(
            "\nHDF5 and NetCDF-4 are not among them: benches/peers/hdf5_files.py writes them to FOLDER."
        );
    }
    println!();
    println!("| cancelled after, ms | of 2 GiB, returns after, ms |");
    println!("|---|---|");
    let large = volumes::two_gigabytes(&folder).expect("the folder has room");
    for after in CANCELS_MS {
        println!("| {after} | {} |", cancelled(&large.opened, Duration::from_millis(after)));
    }
    remove(&large.opened);
}

fn of_file(written: &Written) -> String {
    let [mut opening, mut reading, mut loading] = [f64::INFINITY; 3];
    let mut peak = 0;
    for _ in 0..RUNS {
        reading = reading.min(reading_ms(written));
        loading = loading.min(loading_ms(&written.opened));
        let before = resident_bytes("VmRSS:");
        std::fs::write("/proc/self/clear_refs", "5").expect("Linux forgets the greatest size");
        let start = Instant::now();
        let opened = open(&written.opened, &OpenOptions::default(), &Ticket::new());
        opening = opening.min(start.elapsed().as_secs_f64() * 1000.0);
        let grid = opened.expect("it is a valid file").grid;
        assert_eq!(grid.lattice.len(), BYTES / 2, "{}: all of it", written.name);
        peak = peak.max(resident_bytes("VmHWM:").saturating_sub(before));
    }
    format!(
        "| {} | {opening:.0} | {loading:.0} | {reading:.0} | {:.0}, {:.0} | {:.2} |",
        written.name,
        100.0 * loading / opening,
        100.0 * reading / opening,
        peak as f64 / BYTES as f64
    )
}

/// What the system's own tool takes to read all of its files.
fn reading_ms(written: &Written) -> f64 {
    let tool = if written.is_gzip { "zcat" } else { "cat" };
    let start = Instant::now();
    let mut command = Command::new("find");
    command.arg(&written.opened).args(["-type", "f", "-exec", tool, "{}", "+"]);
    let status = command.stdout(Stdio::null()).status().expect("find runs");
    assert!(status.success(), "{tool} reads {}", written.name);
    start.elapsed().as_secs_f64() * 1000.0
}

/// What it takes to have all bytes of all files in memory.
fn loading_ms(path: &Path) -> f64 {
    let start = Instant::now();
    let files: Vec<_> = match std::fs::read_dir(path) {
        Ok(entries) => entries.filter_map(Result::ok).map(|entry| entry.path()).collect(),
        Err(_) => vec![path.to_owned()],
    };
    let bytes: Vec<Vec<u8>> = files.iter().filter_map(|file| std::fs::read(file).ok()).collect();
    std::hint::black_box(&bytes);
    start.elapsed().as_secs_f64() * 1000.0
}

/// How long opening goes on once it was told to stop.
fn cancelled(path: &Path, after: Duration) -> String {
    let ticket = Ticket::new();
    std::thread::scope(|scope| {
        let worker = scope.spawn(|| open(path, &OpenOptions::default(), &ticket).is_err());
        std::thread::sleep(after);
        ticket.cancel();
        let start = Instant::now();
        match worker.join().expect("no panic") {
            true => format!("{:.1}", start.elapsed().as_secs_f64() * 1000.0),
            false => "open already".to_owned(),
        }
    })
}

/// A size of this process as Linux tells it.
fn resident_bytes(what: &str) -> usize {
    let status = std::fs::read_to_string("/proc/self/status").expect("Linux tells it");
    let line = status.lines().find_map(|line| line.strip_prefix(what)).expect("it is told");
    line.trim().trim_end_matches(" kB").parse::<usize>().expect("a number") * 1024
}

fn remove(path: &Path) {
    let removed =
        if path.is_dir() { std::fs::remove_dir_all(path) } else { std::fs::remove_file(path) };
    removed.expect("what was written can be removed");
}
