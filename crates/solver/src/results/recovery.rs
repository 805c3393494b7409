//! Motion of the nodes over one period, from the harmonic coefficients of their displacement.

use std::f64::consts::TAU;

/// Nodal vector field, m.
pub type NodalField = Vec<[f64; 3]>;

/// Oscillation of the nodes at the phase `w t`: `sum_k C_k cos(k w t) + S_k sin(k w t)`, without
/// the mean. `coefficients` holds 2H+1 fields: mean, cosine 1, sine 1, cosine 2, ...
pub fn oscillation(coefficients: &[NodalField], phase_rad: f64) -> NodalField {
    let nodes = coefficients.first().map_or(0, Vec::len);
    let mut field = vec![[0.0; 3]; nodes];
    for (k, pair) in coefficients
        .get(1..)
        .unwrap_or_default()
        .chunks_exact(2)
        .enumerate()
    {
        let (sin, cos) = ((k + 1) as f64 * phase_rad).sin_cos();
        for (u, (c, s)) in field.iter_mut().zip(pair[0].iter().zip(&pair[1])) {
            for axis in 0..3 {
                u[axis] += cos * c[axis] + sin * s[axis];
            }
        }
    }
    field
}

/// Phase `w t` of frame `frame` of `frames` evenly spaced over one period, the end left out (it is
/// the start of the next).
pub fn frame_phase_rad(frame: usize, frames: usize) -> f64 {
    TAU * frame as f64 / frames as f64
}

/// Sum of two fields, node by node.
pub fn added(mean: &[[f64; 3]], oscillation: &[[f64; 3]]) -> NodalField {
    mean.iter()
        .zip(oscillation)
        .map(|(m, o)| [m[0] + o[0], m[1] + o[1], m[2] + o[2]])
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_follow_the_harmonics_and_leave_the_mean_out() {
        let coefficients = vec![
            vec![[5.0, 0.0, 0.0]],
            vec![[1.0, 0.0, 0.0]],
            vec![[0.0, 2.0, 0.0]],
            vec![[0.0, 0.0, 3.0]],
            vec![[0.5, 0.0, 0.0]],
        ];
        for frame in 0..8 {
            let phase = frame_phase_rad(frame, 8);
            let u = oscillation(&coefficients, phase)[0];
            let expected = [
                phase.cos() + 0.5 * (2.0 * phase).sin(),
                2.0 * phase.sin(),
                3.0 * (2.0 * phase).cos(),
            ];
            for axis in 0..3 {
                assert!((u[axis] - expected[axis]).abs() < 1e-14);
            }
        }
        assert!((frame_phase_rad(2, 8) - TAU / 4.0).abs() < 1e-15);
        assert_eq!(added(&[[1.0, 2.0, 3.0]], &[[1.0; 3]]), [[2.0, 3.0, 4.0]]);
    }

    #[test]
    fn a_mean_alone_does_not_move() {
        assert_eq!(oscillation(&[vec![[1.0; 3]; 2]], 0.3), vec![[0.0; 3]; 2]);
        assert!(oscillation(&[], 0.3).is_empty());
    }
}
