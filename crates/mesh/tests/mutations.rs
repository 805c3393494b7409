//! Random changes of sound files: a reader gives a mesh or an error, and never panics or hangs.

use std::time::{Duration, Instant};

use dovetail_mesh::{formats, quality};
use dovetail_testkit::folder::root;

/// Changed files of each format.
const FILES: usize = 2000;
/// Longest time for a changed file of a few thousand bytes.
const MOST: Duration = Duration::from_secs(2);
/// Bytes that matter to the formats.
const BYTES: &[u8] = b" ,+-*$=!/.()0123456789EeDdNn'\"\t\n\r\xff";
/// Lines that matter to the formats.
const LINES: [&str; 14] = [
    "",
    "-1",
    "      -1",
    "N,UNBL,LOC,-1,",
    "EBLOCK,19,SOLID,9,9",
    "(19i8)",
    "CMBLOCK,X,ELEM,99999999999999999999",
    "GRID,18446744073709551615,,1.+308,1.+308",
    "CHEXA,9,9,1,1,1,1,1,1",
    "+,,,,,,,,",
    "*",
    "INCLUDE 'x'",
    "/INPUT,x",
    "SET 1 = 1 THRU 18446744073709551615",
];

/// Numbers from a seed (xorshift).
struct Numbers(u64);

impl Numbers {
    fn below(&mut self, end: usize) -> usize {
        for shift in [13, -7, 17] {
            self.0 ^= if shift > 0 {
                self.0 << shift
            } else {
                self.0 >> -shift
            };
        }
        (self.0 >> 11) as usize % end.max(1)
    }
}

fn changed(bytes: &[u8], numbers: &mut Numbers) -> Vec<u8> {
    let mut lines: Vec<Vec<u8>> = bytes.split(|b| *b == b'\n').map(<[u8]>::to_vec).collect();
    for _ in 0..=numbers.below(4) {
        let [at, other] = [numbers.below(lines.len()), numbers.below(lines.len())];
        let within = numbers.below(lines[at].len());
        match numbers.below(8) {
            0 => drop(lines.remove(at)),
            1 => lines.swap(at, other),
            2 => lines.insert(at, LINES[numbers.below(LINES.len())].into()),
            3 => lines.insert(at, lines[other].clone()),
            4 => lines[at].truncate(within),
            5 => lines[at].insert(within, BYTES[numbers.below(BYTES.len())]),
            _ => {
                let byte = BYTES[numbers.below(BYTES.len())];
                if let Some(old) = lines[at].get_mut(within) {
                    *old = byte;
                }
            }
        }
        if lines.is_empty() {
            lines.push(Vec::new());
        }
    }
    lines.join(&b'\n')
}

fn try_changes(folder: &str) {
    let seeds = std::fs::read_dir(root().join("fuzz/seeds").join(folder)).unwrap();
    let mut seeds: Vec<_> = seeds.map(|entry| entry.unwrap().path()).collect();
    seeds.sort();
    let (mut opened, mut refused) = (0, 0);
    let mut numbers = Numbers(0x9e37_79b9_7f4a_7c15);
    for i in 0..FILES {
        let path = &seeds[i % seeds.len()];
        let bytes = changed(&std::fs::read(path).unwrap(), &mut numbers);
        let before = Instant::now();
        let mut include = |_: &str| Ok(b"GRID,1\nN,1\n".to_vec());
        let content = formats::parse(&bytes, &path.to_string_lossy(), &mut include);
        match content.and_then(|content| content.into_mesh(1.0.into())) {
            Ok(mesh) => {
                let _ = quality::check(&mesh);
                opened += 1;
            }
            Err(error) => {
                assert!(!error.to_string().is_empty());
                refused += 1;
            }
        }
        let text = String::from_utf8_lossy(&bytes);
        assert!(before.elapsed() < MOST, "{folder}, change {i}:\n{text}");
    }
    println!("{folder}: {opened} opened, {refused} refused");
    assert!(opened > 100 && refused > 100);
}

#[test]
fn changed_archives_of_ansys_are_meshes_or_errors() {
    try_changes("ansys");
}

#[test]
fn changed_bulk_data_are_meshes_or_errors() {
    try_changes("nastran");
}
