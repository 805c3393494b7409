//! Arrays of numbers as text that a page unpacks: base64 of little-endian bytes.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use serde::Serialize;

/// Numbers `low + step i` with 16-bit integers i.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Scaled {
    low: f64,
    step: f64,
    u16: String,
}

/// Packs numbers to 1.6e-5 of their range; numbers that are not finite become the smallest.
pub(super) fn scaled(values: impl Iterator<Item = f64> + Clone) -> Scaled {
    let finite = || values.clone().filter(|v| v.is_finite());
    let low = finite().reduce(f64::min).unwrap_or(0.0);
    let high = finite().reduce(f64::max).unwrap_or(0.0);
    let steps = f64::from(u16::MAX);
    let step = (high - low) / steps;
    let number = |v: f64| {
        if step > 0.0 {
            // A cast saturates, and takes a NaN to 0.
            ((v - low) / step).round() as u16
        } else {
            0
        }
    };
    let bytes: Vec<u8> = values.flat_map(|v| number(v).to_le_bytes()).collect();
    Scaled {
        low,
        step,
        u16: STANDARD.encode(bytes),
    }
}

pub(super) fn integers(values: &[u32]) -> String {
    let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
    STANDARD.encode(bytes)
}

pub(super) fn bytes(values: &[u8]) -> String {
    STANDARD.encode(values)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_come_back_to_a_share_of_their_range() {
        let values = [-2.0, 0.0, 0.1, 3.0, f64::NAN];
        let packed = scaled(values.into_iter());
        let bytes = STANDARD.decode(&packed.u16).unwrap();
        let back: Vec<f64> = bytes
            .chunks_exact(2)
            .map(|b| packed.low + packed.step * f64::from(u16::from_le_bytes([b[0], b[1]])))
            .collect();
        for (found, exact) in back.iter().zip(&values[..4]) {
            assert!((found - exact).abs() < 5.0 / 65535.0, "{found} {exact}");
        }
        assert_eq!(back[4], -2.0);
        assert_eq!(scaled([7.0; 2].into_iter()).step, 0.0);
    }
}
