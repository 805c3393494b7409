//! Damaged mesh files: whatever is still read of them can be checked and bound.

use crate::shared_bodies::MM;
use crate::shared_scenes::{blocks_assembly, bytes};
use dovetail_mesh::quality;
use dovetail_solver::model::bind;

/// Reads the bytes as a mesh. The answer is a mesh, which can be checked and bound, or an error.
fn survives(bytes: Vec<u8>) -> bool {
    match dovetail_mesh::parse(bytes, MM) {
        Ok(mesh) => {
            let _ = quality::check(&mesh);
            if let Ok(model) = bind(&blocks_assembly(), &mesh, None) {
                assert!(model.pairs.iter().all(|p| p.area_m2.is_finite()));
            }
            true
        }
        Err(error) => {
            assert!(error.to_string().len() < 2000);
            false
        }
    }
}

#[test]
fn damaged_files_never_panic() {
    let mut state = 0x9e37_79b9_7f4a_7c15_u64; // xorshift: the same damage in every run
    let mut random = |below: usize| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state % below as u64) as usize
    };
    let (mut read, mut refused) = (0, 0);
    for name in [
        "blocks_order1.msh",
        "blocks_order2.msh",
        "blocks_binary.msh",
    ] {
        let whole = bytes(name);
        for _ in 0..1500 {
            let mut damaged = whole.clone();
            for _ in 0..=random(3) {
                let at = random(damaged.len());
                match random(4) {
                    0 => damaged[at] = random(256) as u8,
                    1 => damaged[at] = b"0123456789 -\n$."[random(15)],
                    2 => damaged[at] ^= 1 << random(8),
                    _ => {
                        let end = (at + random(40)).min(damaged.len());
                        damaged.drain(at..end);
                    }
                }
            }
            if survives(damaged) {
                read += 1;
            } else {
                refused += 1;
            }
        }
    }
    println!("{read} read, {refused} refused");
    assert!(
        read > 100 && refused > 1000,
        "the damage is too weak or too strong to test anything"
    );
}
