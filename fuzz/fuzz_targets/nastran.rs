//! Bulk data of Nastran. A file that they include is the second half of the input, behind a line
//! `=== include`.

#![no_main]

mod checks;
mod limits;

use dovetail_mesh::formats::nastran;

const BETWEEN: &[u8] = b"\n=== include\n";

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| limits::hold(bytes, read));

fn read(bytes: &[u8]) {
    let at = bytes.windows(BETWEEN.len()).position(|w| w == BETWEEN);
    let (bulk, included) = match at {
        Some(at) => (&bytes[..at], &bytes[at + BETWEEN.len()..]),
        None => (bytes, &b""[..]),
    };
    checks::content(nastran::parse(bulk, &mut |_| Ok(included.to_vec())));
}
