//! Rotation: closed forms, tables, and the geometric stiffness itself.

use dovetail_mesh::interpolation::reference_nodes;
use dovetail_mesh::{ElementType, Shape};
use dovetail_solver::fem::assemble_body;
use dovetail_solver::fem::elasticity::{Lame, map_gradients};
use dovetail_solver::fem::element::{Deformed, Element, Isoparametric};
use dovetail_solver::fem::elements::element;
use dovetail_solver::fem::statics::held_displacement;
use dovetail_solver::fem::stress::nodal_stress;
use dovetail_solver::model::{Body, Rotation};
use dovetail_solver::model::{BodyPrestress, Material};
use dovetail_testkit::block::{block, map_nodes};

use super::algebra::*;
use super::bodies::*;

/// A bar along x from radius `near_m`, spinning about z, its near end a flank.
fn bar(near_m: f64, length_m: f64, thickness_m: f64, cells: usize) -> Body {
    let size = [length_m, thickness_m, thickness_m];
    let mut mesh = block(ElementType::TET10, [cells, 1, 1], size);
    map_nodes(&mut mesh, |p| {
        [p[0] + near_m, p[1] - 0.5 * size[1], p[2] - 0.5 * size[2]]
    });
    body_with_flank(
        &mesh,
        Material {
            poisson: 0.0,
            ..STEEL
        },
        "x_min",
    )
}

pub fn rotation_about_z(speed_rad_s: f64, prestress: BodyPrestress) -> Rotation {
    Rotation {
        point_m: [0.0; 3],
        axis: [0.0, 0.0, 1.0],
        speed_rad_s,
        prestress,
        prestress_of_contact: false,
    }
}

#[test]
fn rotating_bar_stretches_as_the_textbook_says() {
    // E u' = rho W^2 (tip^2 - r^2) / 2 (Timoshenko, Theory of Elasticity), u = 0 at the near end.
    let (near, tip) = (0.1, 0.5);
    let body = bar(near, tip - near, 0.004, 20);
    let all = assemble_body(
        &body,
        Some(&rotation_about_z(SPIN, BodyPrestress::None)),
        &never,
    )
    .unwrap();
    let u = held_displacement(&body, &all.stiffness, &all.load_n, &solve).unwrap();
    let c = STEEL.density_kg_m3 * SPIN * SPIN;
    let exact = |r: f64| {
        c / STEEL.young_pa * (0.5 * tip * tip * (r - near) - (r.powi(3) - near.powi(3)) / 6.0)
    };
    for (p, u) in body.nodes_m.iter().zip(&u) {
        assert!(
            (u[0] - exact(p[0])).abs() < 1e-4 * exact(tip),
            "{} {}",
            u[0],
            exact(p[0])
        );
    }
    let hub_stress = 0.5 * c * (tip * tip - near * near);
    for (p, s) in body.nodes_m.iter().zip(nodal_stress(&body, &u)) {
        if p[0] > near + 0.05 {
            let exact = 0.5 * c * (tip * tip - p[0] * p[0]);
            assert!((s[0] - exact).abs() < 5e-3 * hub_stress, "{} {exact}", s[0]);
        }
    }
}

#[test]
fn rotating_cantilever_has_the_tabulated_frequencies() {
    // Wright, Smith, Thresher, Wang, J. Appl. Mech. 49 (1982) 197: hub radius 0, uniform beam,
    // frequency and speed in units of sqrt(E I / (rho A L^4)), out of the plane of rotation. In the
    // plane the spin softening takes the square of the speed off the square of the frequency.
    let (length, thickness) = (0.5, 0.01);
    let body = bar(0.0, length, thickness, 14);
    let unit = (STEEL.young_pa * thickness * thickness / (12.0 * STEEL.density_kg_m3)).sqrt()
        / (length * length);
    let n = 3 * body.dofs.interior_nodes;
    for (speed, tabulated) in [(0.0, 3.5160), (2.0, 4.1373), (6.0, 7.3604), (12.0, 13.1702)] {
        let rotation = rotation_about_z(speed * unit, BodyPrestress::HeldFlanks);
        let all = assemble_body(&body, Some(&rotation), &solve).unwrap();
        let w2 = eigenvalues(&all.stiffness, &all.mass, n);
        let (lag, flap) = (w2[0].sqrt() / unit, w2[1].sqrt() / unit);
        let lag_exact = (tabulated * tabulated - speed * speed).sqrt();
        println!("speed {speed}: flap {flap:.4} ({tabulated}), lag {lag:.4} ({lag_exact:.4})");
        assert!(
            (flap / tabulated - 1.0).abs() < 1e-3,
            "flap {flap} {tabulated}"
        );
        assert!(
            (lag / lag_exact - 1.0).abs() < 7e-3,
            "lag {lag} {lag_exact}"
        );
    }
}

#[test]
fn turning_the_spinning_body_about_its_axis_costs_nothing() {
    // The prestressed body is in equilibrium in the rotating frame, and so is the body turned about
    // the axis: (K + G - Omega^2 P M)(a x r) = 0 wherever no support force acts.
    for mesh in meshes() {
        let body = body_with_flank(&mesh, STEEL, "x_min");
        let mut rotation = rotation(BodyPrestress::HeldFlanks);
        // Fast, so that the elastic rounding is small beside the softening.
        rotation.speed_rad_s = 2e4;
        let all = assemble_body(&body, Some(&rotation), &solve).unwrap();
        let turned = field(&body, |p| {
            cross(rotation.axis, [0, 1, 2].map(|k| p[k] - rotation.point_m[k]))
        });
        let force = times(&all.stiffness, &turned);
        let softening = rotation.speed_rad_s.powi(2) * largest(&times(&all.mass, &turned));
        let inner = 3 * body.dofs.interior_nodes;
        let off = largest(&force[..inner]) / softening;
        assert!(off < 1e-9, "{off:e}");
        assert!(largest(&force[inner..]) > softening, "the support pulls");
    }
}

#[test]
fn a_body_that_does_not_rotate_is_left_alone() {
    let mut body = body_with_flank(&bent(Filling::Of(ElementType::TET10)), STEEL, "x_min");
    body.rotates = false;
    let all = assemble_body(&body, Some(&rotation(BodyPrestress::HeldFlanks)), &never).unwrap();
    assert!(all.stiffness == matrices(&body).stiffness);
    assert_eq!(largest(&all.load_n), 0.0);
}

/// Element of its own, bent and skewed, without any symmetry.
fn bent_element(element: ElementType) -> Vec<[f64; 3]> {
    let place = |[x, y, z]: [f64; 3]| {
        [
            0.02 * x + 0.004 * y * z + 0.003 * x * x,
            0.025 * y - 0.003 * x * z + 0.002 * y * y,
            0.03 * z + 0.002 * x * y - 0.003 * z * x,
        ]
    };
    let cube = |[u, v, w]: [f64; 3]| match element.shape {
        Shape::Pyramid => [0.5 * (1.0 - w) * u, 0.5 * (1.0 - w) * v, w],
        _ => [u, v, w],
    };
    let nodes = reference_nodes(element).into_iter();
    nodes.map(|p| place(cube(p))).collect()
}

/// Energy of Green's strain with Hooke's law. Along infinitesimal rotations v the linear strain
/// is zero, so d/ds (d2/dt2) energy(s u0 + t v) at s = t = 0 is v^T G(u0) v alone.
fn energy_has_the_geometric_stiffness<const N: usize>(element: ElementType) {
    let x = bent_element(element);
    let nodal = |values: &[[f64; 3]]| -> [[f64; 3]; N] { values.try_into().unwrap() };
    let u0: Vec<[f64; 3]> = x
        .iter()
        .map(|p| {
            let u = apply(GRADIENT, *p);
            [
                u[0] + 0.3 * p[1] * p[2],
                u[1] - 0.2 * p[0] * p[2],
                u[2] + 0.4 * p[0] * p[1],
            ]
        })
        .collect();
    let v: Vec<[f64; 3]> = x.iter().map(|p| cross([0.3, -0.5, 0.9], *p)).collect();
    let lame = Lame::from(STEEL);
    let integrals = Isoparametric::<N>::new(element);
    let rule = &integrals.tables.stiffness;
    let energy_density = |g: &[[f64; 3]; N], s: f64, t: f64| {
        let mut h = [[0.0; 3]; 3];
        for a in 0..N {
            for r in 0..3 {
                for c in 0..3 {
                    h[r][c] += (s * u0[a][r] + t * v[a][r]) * g[a][c];
                }
            }
        }
        let (mut trace, mut square) = (0.0, 0.0);
        for r in 0..3 {
            for c in 0..3 {
                let product: f64 = h.iter().map(|row| row[r] * row[c]).sum();
                let strain: f64 = 0.5 * (h[r][c] + h[c][r] + product);
                square += strain * strain;
                trace += if r == c { strain } else { 0.0 };
            }
        }
        0.5 * lame.lambda_pa * trace * trace + lame.mu_pa * square
    };
    let energy = |s: f64, t: f64| -> f64 {
        let points = rule.gradients.iter().zip(&rule.weights);
        points
            .map(|(reference, weight)| {
                let (det, g) = map_gradients(&nodal(&x), reference);
                det * weight * energy_density(&g, s, t)
            })
            .sum()
    };
    // The energy is a quartic polynomial in (s, t): central differences and one Richardson step are
    // exact but for rounding.
    let mixed = |h: f64| {
        let second = |s: f64| (energy(s, h) - 2.0 * energy(s, 0.0) + energy(s, -h)) / (h * h);
        (second(h) - second(-h)) / (2.0 * h)
    };
    let derivative = (4.0 * mixed(0.5) - mixed(1.0)) / 3.0;
    let mut g = vec![[0.0]; N * N];
    let deformed = Deformed::new(&x, &u0, lame);
    integrals.geometric_stiffness(&deformed, &mut g);
    let quadratic: f64 = (0..N * N)
        .map(|k| g[k][0] * dot(&v[k / N], &v[k % N]))
        .sum();
    assert!(
        (quadratic / derivative - 1.0).abs() < 1e-8,
        "{element:?}: {quadratic} {derivative}"
    );
    assert!(largest(&integrals.centre_stress(&deformed)) > 1e7);
}

#[test]
fn geometric_stiffness_is_the_derivative_of_the_strain_energy() {
    energy_has_the_geometric_stiffness::<4>(ElementType::TET4);
    energy_has_the_geometric_stiffness::<10>(ElementType::TET10);
    energy_has_the_geometric_stiffness::<5>(ElementType::PYRAMID5);
    energy_has_the_geometric_stiffness::<13>(ElementType::PYRAMID13);
    energy_has_the_geometric_stiffness::<6>(ElementType::WEDGE6);
    energy_has_the_geometric_stiffness::<15>(ElementType::WEDGE15);
    energy_has_the_geometric_stiffness::<8>(ElementType::HEX8);
    energy_has_the_geometric_stiffness::<20>(ElementType::HEX20);
}

#[test]
fn geometric_stiffness_does_not_see_the_frame() {
    let (s, c) = (0.6, 0.8);
    let turn = |p: &[f64; 3]| {
        let q = [c * p[0] - s * p[1], s * p[0] + c * p[1], p[2]];
        [q[0], c * q[1] - s * q[2], s * q[1] + c * q[2]]
    };
    for kind in ElementType::ALL {
        let x = bent_element(kind);
        let u: Vec<[f64; 3]> = x.iter().map(|p| apply(GRADIENT, *p)).collect();
        let of = |x: &[[f64; 3]], u: &[[f64; 3]]| {
            let mut g = vec![[0.0]; x.len() * x.len()];
            element(kind).geometric_stiffness(&Deformed::new(x, u, Lame::from(STEEL)), &mut g);
            g.concat()
        };
        let turned = |all: &[[f64; 3]]| all.iter().map(turn).collect::<Vec<_>>();
        let (here, there) = (of(&x, &u), of(&turned(&x), &turned(&u)));
        let difference: Vec<f64> = here.iter().zip(&there).map(|(a, b)| a - b).collect();
        assert!(largest(&difference) < 1e-12 * largest(&here), "{kind:?}");
    }
}
