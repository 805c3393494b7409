use dovetail::dlft::PairStatus;
use dovetail::dlft::static_state::static_state;
use dovetail::dlft::sweep::eps_of;
use dovetail::numerics::newton::NewtonOptions;
use dovetail::reduction::{PairLaw, superelement};
use dovetail::scene::EpsChoice;
use std::path::Path;

#[test]
fn statics() {
    for folder in [
        "tests/data/dovetail72".to_string(),
        std::env::var("OTHER").unwrap(),
    ] {
        let folder = Path::new(&folder);
        for friction in [0.0, 1e-6, 0.01, 0.3, 1.0, 2.0, 3.0, 10.0, 100.0, 1e6] {
            let law = PairLaw {
                friction,
                gap_m: 0.0,
            };
            let model = superelement::read(folder, law, 1.0).unwrap().relative;
            for scale in [1.0, 0.1, 10.0] {
                let eps = eps_of(&model, EpsChoice::Pair, scale);
                let s = static_state(
                    &model,
                    &eps,
                    10,
                    NewtonOptions {
                        tolerance: 1e-10,
                        max_iterations: 100,
                    },
                );
                let count = |w| s.status.iter().filter(|x| **x == w).count();
                println!(
                    "mu {friction} eps {scale}: {:?} {} it, res {:.1e}, {}/{}/{} held {:?}",
                    s.outcome,
                    s.newton_iterations,
                    s.residual,
                    count(PairStatus::Stuck),
                    count(PairStatus::Slipping),
                    count(PairStatus::Open),
                    s.retention_n
                );
            }
        }
    }
}
