//! Unilateral contact with Coulomb friction (circular cone), at one instant of one pair. The trial
//! force, with which the pair would stick, gives the contact force (Nacivet et al. 2003, equations
//! 20-26).

/// State of a pair at one instant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Contact {
    /// Stick: the contact force is the predicted one.
    Stick,
    /// Slip: the tangential force is at its limit.
    Slip,
    /// Open: there is no force.
    Open,
}

/// Contact force for the predicted force `(N, t1, t2)`, N; compression is negative.
///
/// * `predicted_N >= 0`: open, no force;
/// * `|predicted_T| < mu |predicted_N|`: stick, the prediction itself;
/// * otherwise slip: the tangential prediction brought back to the cone.
#[inline(always)]
pub fn unilateral_coulomb(predicted: [f64; 3], friction: f64) -> (Contact, [f64; 3]) {
    let [normal, t1, t2] = predicted;
    if normal >= 0.0 {
        return (Contact::Open, [0.0; 3]);
    }
    let limit = -friction * normal;
    let tangential = length(t1, t2);
    if tangential < limit {
        (Contact::Stick, predicted)
    } else if tangential == 0.0 {
        (Contact::Slip, [normal, 0.0, 0.0])
    } else {
        let scale = limit / tangential;
        (Contact::Slip, [normal, scale * t1, scale * t2])
    }
}

/// Length of a tangential force. (Forces are far from overflow: `hypot` would cost a sixth of a
/// run.)
#[inline(always)]
pub fn length(t1: f64, t2: f64) -> f64 {
    (t1 * t1 + t2 * t2).sqrt()
}

/// Derivative of the slip force: `d lambda_T = -mu e d p_N + kappa (I - e e^T) d p_T`.
#[derive(Debug, Clone, Copy)]
pub struct SlipTangent {
    /// Direction of sliding e, unit (zero where the prediction has no tangential part).
    pub direction: [f64; 2],
    /// mu |p_N| / |p_T|, at most 1.
    pub kappa: f64,
}

/// Derivative of [`unilateral_coulomb`] where the pair slips.
#[inline(always)]
pub fn slip_tangent(predicted: [f64; 3], friction: f64) -> SlipTangent {
    let [normal, t1, t2] = predicted;
    let tangential = length(t1, t2);
    if tangential == 0.0 {
        return SlipTangent {
            direction: [0.0; 2],
            kappa: 0.0,
        };
    }
    SlipTangent {
        direction: [t1 / tangential, t2 / tangential],
        kappa: (-friction * normal / tangential).min(1.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn force_stays_on_or_inside_the_cone_and_never_pulls() {
        for i in 0..2000 {
            let p = [
                (i as f64).sin(),
                (i as f64 * 1.3).cos(),
                (i as f64 * 0.7).sin() * 2.0,
            ];
            let (state, f) = unilateral_coulomb(p, 0.3);
            assert!(f[0] <= 0.0);
            assert!(f[1].hypot(f[2]) <= -0.3 * f[0] * (1.0 + 1e-15));
            match state {
                Contact::Open => assert!(p[0] >= 0.0 && f == [0.0; 3]),
                Contact::Stick => assert_eq!(f, p),
                Contact::Slip => {
                    assert!((f[1].hypot(f[2]) + 0.3 * f[0]).abs() < 1e-15);
                    assert!(
                        (f[1] * p[2] - f[2] * p[1]).abs() < 1e-15,
                        "along the prediction"
                    );
                }
            }
        }
    }

    #[test]
    fn what_touches_the_cone_slips_and_what_is_not_pressed_is_open() {
        for (predicted, contact) in [
            ([-1.0, 0.5, 0.0], Contact::Slip),
            ([-1.0, 0.0, 0.0], Contact::Stick),
            ([0.0, 0.0, 0.0], Contact::Open),
        ] {
            assert_eq!(unilateral_coulomb(predicted, 0.5).0, contact);
        }
        // Without friction nothing sticks.
        let (contact, force) = unilateral_coulomb([-1.0, 0.0, 0.0], 0.0);
        assert_eq!((contact, force), (Contact::Slip, [-1.0, 0.0, 0.0]));
    }

    #[test]
    fn slip_tangent_is_the_derivative() {
        let p = [-2.0, 0.9, -1.4];
        let tangent = slip_tangent(p, 0.4);
        let h = 1e-6;
        for axis in 0..3 {
            let (mut up, mut down) = (p, p);
            up[axis] += h;
            down[axis] -= h;
            let (_, fu) = unilateral_coulomb(up, 0.4);
            let (_, fd) = unilateral_coulomb(down, 0.4);
            for c in 0..2 {
                let e = tangent.direction;
                let exact = if axis == 0 {
                    -0.4 * e[c]
                } else {
                    let delta = if axis - 1 == c { 1.0 } else { 0.0 };
                    tangent.kappa * (delta - e[c] * e[axis - 1])
                };
                assert!(((fu[c + 1] - fd[c + 1]) / (2.0 * h) - exact).abs() < 1e-9);
            }
        }
    }
}
