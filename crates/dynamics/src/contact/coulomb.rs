//! Unilateral contact with Coulomb friction (circular cone), at one instant of one pair. The trial
//! force, with which the pair would stick, gives the contact force (Nacivet et al. 2003, equations
//! 20-26).

use dovetail_numerics::dual::Real;

/// Status of a pair at one instant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Contact {
    /// Stick: the contact force is the trial force.
    Stick,
    /// Slip: the tangential force is at its limit.
    Slip,
    /// Open: there is no force.
    Open,
}

/// Contact force for the trial force `(N, t1, t2)`, N; compression is negative.
///
/// * `trial_N >= 0`: open, no force;
/// * `|trial_T| < mu |trial_N| - touch_n`: stick, the trial force itself;
/// * otherwise slip: the tangential trial force brought to the cone.
#[inline(always)]
pub(crate) fn unilateral_coulomb<D: Real>(
    trial: [D; 3],
    friction: f64,
    touch_n: f64,
) -> (Contact, [D; 3]) {
    let zero = D::from(0.0);
    let [normal, t1, t2] = trial;
    if normal.re() >= 0.0 {
        return (Contact::Open, [zero; 3]);
    }
    let limit = normal * -friction;
    let tangential = length(t1, t2);
    if tangential.re() < limit.re() - touch_n {
        (Contact::Stick, trial)
    } else if tangential.re() == 0.0 {
        (Contact::Slip, [normal, zero, zero])
    } else {
        let scale = limit / tangential;
        (Contact::Slip, [normal, t1 * scale, t2 * scale])
    }
}

/// Length of a tangential force. (Forces are far from overflow: `hypot` would cost a sixth of a
/// run.)
#[inline(always)]
pub(crate) fn length<D: Real>(t1: D, t2: D) -> D {
    (t1 * t1 + t2 * t2).sqrt()
}

/// Derivative of the slip force: `d lambda_T = -mu e d p_N + kappa (I - e e^T) d p_T`, with the
/// trial force p.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SlipTangent {
    /// Direction of sliding e, unit (zero where the trial force has no tangential part).
    pub direction: [f64; 2],
    /// -mu e.
    pub by_normal: [f64; 2],
    /// mu |p_N| / |p_T|, at most 1.
    pub kappa: f64,
}

/// Derivative of [`unilateral_coulomb`] where the pair slips.
#[inline(always)]
pub(crate) fn slip_tangent(trial: [f64; 3], friction: f64) -> SlipTangent {
    let [normal, t1, t2] = trial;
    let tangential = length(t1, t2);
    if tangential == 0.0 {
        return SlipTangent {
            direction: [0.0; 2],
            by_normal: [0.0; 2],
            kappa: 0.0,
        };
    }
    let direction = [t1 / tangential, t2 / tangential];
    SlipTangent {
        direction,
        by_normal: direction.map(|e| -friction * e),
        kappa: (-friction * normal / tangential).min(1.0),
    }
}

/// Fraction w of a way at which the trial force `from + step w` of a closed pair leaves the cone,
/// at most `last`. It begins on the cone where the pair slips.
#[inline(always)]
pub(crate) fn leaves_cone<D: Real>(
    from: [D; 3],
    step: [D; 3],
    friction: f64,
    slips: bool,
    last: D,
) -> D {
    let zero = D::from(0.0);
    // The cone's equation along the way, a + b w + c w^2 with a <= 0.
    let mu2 = friction * friction;
    let (a, b, c) = (
        form(from, from, mu2),
        form(from, step, mu2) * 2.0,
        form(step, step, mu2),
    );
    let way = if slips || a.re() >= 0.0 {
        if b.re() >= 0.0 { zero } else { -b / c }
    } else {
        let under = b * b - a * c * 4.0;
        if under.re() <= 0.0 {
            return last;
        }
        let root = under.sqrt();
        if b.re() >= 0.0 {
            a * -2.0 / (b + root)
        } else {
            (root - b) / (c * 2.0)
        }
    };
    if way.re() >= 0.0 && way.re() < last.re() {
        way
    } else {
        last
    }
}

/// Bilinear form of the cone, whose quadratic form is negative inside.
#[inline(always)]
fn form<D: Real>(p: [D; 3], q: [D; 3], mu2: f64) -> D {
    p[1] * q[1] + p[2] * q[2] - p[0] * q[0] * mu2
}

/// Returns `true` if a force on the cone goes into the cone with this step.
#[inline(always)]
pub(crate) fn turns_inward(force: [f64; 3], step: [f64; 3], friction: f64) -> bool {
    let [normal, t1, t2] = [0, 1, 2].map(|c| force[c] * step[c]);
    t1 + t2 < friction * friction * normal
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
            let (state, f) = unilateral_coulomb(p, 0.3, 0.0);
            assert!(f[0] <= 0.0);
            assert!(f[1].hypot(f[2]) <= -0.3 * f[0] * (1.0 + 1e-15));
            match state {
                Contact::Open => assert!(p[0] >= 0.0 && f == [0.0; 3]),
                Contact::Stick => assert_eq!(f, p),
                Contact::Slip => {
                    assert!((f[1].hypot(f[2]) + 0.3 * f[0]).abs() < 1e-15);
                    assert!(
                        (f[1] * p[2] - f[2] * p[1]).abs() < 1e-15,
                        "along the trial force"
                    );
                }
            }
        }
    }

    #[test]
    fn what_touches_the_cone_slips_and_what_is_not_pressed_is_open() {
        for (trial, contact) in [
            ([-1.0, 0.5, 0.0], Contact::Slip),
            ([-1.0, 0.0, 0.0], Contact::Stick),
            ([0.0, 0.0, 0.0], Contact::Open),
        ] {
            assert_eq!(unilateral_coulomb(trial, 0.5, 0.0).0, contact);
        }
        // Without friction nothing sticks.
        let (contact, force) = unilateral_coulomb([-1.0, 0.0, 0.0], 0.0, 0.0);
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
            let (_, fu) = unilateral_coulomb(up, 0.4, 0.0);
            let (_, fd) = unilateral_coulomb(down, 0.4, 0.0);
            for c in 0..2 {
                let e = tangent.direction;
                let exact = if axis == 0 {
                    tangent.by_normal[c]
                } else {
                    let delta = if axis - 1 == c { 1.0 } else { 0.0 };
                    tangent.kappa * (delta - e[c] * e[axis - 1])
                };
                assert!(((fu[c + 1] - fd[c + 1]) / (2.0 * h) - exact).abs() < 1e-9);
            }
        }
    }
}
