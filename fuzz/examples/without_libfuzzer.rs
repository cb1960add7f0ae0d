//! A reader without libFuzzer: files of some folders, changed at random, for so many seconds. Bytes that break a promise stay in a file.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use afterlight_fuzz::TARGETS;
use fastrand::Rng;

/// Larger files take longer to read than their bytes are worth.
const LARGEST: u64 = 64 << 10;
/// The longest that one file may take.
const LONGEST: Duration = Duration::from_secs(10);

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [name, seconds, seed, failed, folders @ ..] = arguments.as_slice() else {
        let names: Vec<_> = TARGETS.iter().map(|target| target.name).collect();
        eprintln!("usage: without_libfuzzer READER SECONDS SEED FAILED_FILE FOLDER...\nreaders: {}", names.join(", "));
        std::process::exit(2);
    };
    let (seconds, seed): (u64, u64) = (seconds.parse().expect("seconds"), seed.parse().expect("a seed"));
    let mut files = Vec::new();
    folders.iter().for_each(|folder| collect(Path::new(folder), &mut files));
    let corpus: Vec<Vec<u8>> = files.iter().filter_map(|file| fs::read(file).ok()).collect();
    assert!(!corpus.is_empty(), "no files of at most {LARGEST} bytes in {folders:?}");
    let mut random = Rng::with_seed(seed);
    let (start, mut count, mut slowest) = (Instant::now(), 0u64, Duration::ZERO);
    while start.elapsed() < Duration::from_secs(seconds) {
        let mut bytes = corpus[random.usize(..corpus.len())].clone();
        for _ in 0..=random.usize(..8) {
            change(&mut bytes, &corpus, &mut random);
        }
        // Written before they are read: bytes that abort the program stay behind.
        fs::write(failed, &bytes).expect("written");
        let begin = Instant::now();
        afterlight_fuzz::read(name, &bytes);
        slowest = slowest.max(begin.elapsed());
        assert!(begin.elapsed() < LONGEST, "took {:?}", begin.elapsed());
        count += 1;
    }
    fs::remove_file(failed).expect("removed");
    println!("{count} files of {} seeds in {seconds} s, the slowest took {slowest:?}: no fault", corpus.len());
}

fn collect(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a folder").flatten() {
        let path = entry.path();
        if path.is_dir() {
            collect(&path, files);
        } else if entry.metadata().is_ok_and(|own| own.len() <= LARGEST) {
            files.push(path);
        }
    }
    files.sort();
}

/// Numbers that break arithmetic.
const EDGES: [&str; 12] = [
    "0",
    "1",
    "-1",
    "255",
    "65535",
    "4294967295",
    "4294967296",
    "9007199254740993",
    "18446744073709551615",
    "1e308",
    "0.5",
    "null",
];

fn change(bytes: &mut Vec<u8>, corpus: &[Vec<u8>], random: &mut Rng) {
    if bytes.is_empty() {
        return;
    }
    let at = random.usize(..bytes.len());
    match random.u32(..8) {
        0 => bytes[at] = random.u8(..),
        1 => bytes[at] ^= 1 << random.u32(..8),
        2 => bytes.truncate(at),
        3 => {
            let end = (at + random.usize(..64)).min(bytes.len());
            bytes.drain(at..end);
        }
        4 => {
            let other = &corpus[random.usize(..corpus.len())];
            let from = random.usize(..other.len().max(1)).min(other.len());
            let end = (from + random.usize(..256)).min(other.len());
            bytes.splice(at..at, other[from..end].iter().copied());
        }
        // A number of the text for another. In a binary glTF as long, so that its chunks stay where they are.
        _ => {
            let Some(first) = (at..bytes.len()).find(|&place| bytes[place].is_ascii_digit()) else { return };
            let end = (first..bytes.len()).find(|&place| !bytes[place].is_ascii_digit()).unwrap_or(bytes.len());
            if bytes.starts_with(b"glTF") {
                bytes[first..end].iter_mut().for_each(|digit| *digit = b'0' + random.u8(..10));
            } else {
                bytes.splice(first..end, EDGES[random.usize(..EDGES.len())].bytes());
            }
        }
    }
}
