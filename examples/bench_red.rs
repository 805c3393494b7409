use dovetail::dlft::march::Periods;
use dovetail::dlft::static_state::static_state;
use dovetail::dlft::sweep::{SweepSettings, eps_of, sweep};
use dovetail::numerics::newton::NewtonOptions;
use dovetail::reduction::damping::Rayleigh;
use dovetail::reduction::{PairLaw,superelement};
use dovetail::scene::{EpsChoice, Solver};
fn main(){
 let a:Vec<String>=std::env::args().collect();
 let force:f64=a[1].parse().unwrap(); let h:usize=a[2].parse().unwrap(); let ns:usize=a[3].parse().unwrap(); let pts:usize=a[4].parse().unwrap();
 let eps=if a.get(5).map(|s|s=="rho").unwrap_or(false){EpsChoice::SpectralRadius}else{EpsChoice::Pair};
 let solver=if a.get(5).map(|s|s=="powell").unwrap_or(false){Solver::Powell}else{Solver::NewtonKrylov};
 let model=superelement::read(std::path::Path::new("tests/data/dovetail72"),PairLaw{friction:0.3,gap_m:0.0},force).unwrap().relative;
 let d=Rayleigh{stiffness_s:0.002/model.omega2[0].sqrt(),mass_per_s:0.0};
 let nw=NewtonOptions{tolerance:1e-8,max_iterations:60};
 let t=std::time::Instant::now();
 let st=static_state(&model,&eps_of(&model,EpsChoice::Pair,1.0),10,nw);
 println!("static {:?} {} it {:.3}s",st.outcome,st.newton_iterations,t.elapsed().as_secs_f64());
 let f1=model.omega2[0].sqrt()/6.283185307179586;
 let s=SweepSettings{frequencies_hz:(0..pts).map(|i|f1*(0.98+0.04*i as f64/(pts-1) as f64)).collect(),harmonics:h,samples:ns,newton:nw,periods:Periods::UntilPeriodic,solver,slip_threshold_m:None};
 let t=std::time::Instant::now();
 let r=sweep(&model,d,&eps_of(&model,eps,1.0),&st,&s,&|_|());
 let dt=t.elapsed().as_secs_f64();
 let un:Vec<_>=r.orbits.iter().filter(|o|!o.outcome.is_converged()).map(|o|(o.frequency_hz,o.outcome,o.residual,o.newton_iterations)).collect();
 let nwt:usize=r.orbits.iter().map(|o|o.newton_iterations).sum(); let kr:usize=r.orbits.iter().map(|o|o.krylov_iterations).sum();
 let pk=r.orbits.iter().max_by(|a,b|a.observed_amplitude_m[0].total_cmp(&b.observed_amplitude_m[0])).unwrap();
 let lin=r.stuck.iter().map(|s|s.observed_amplitude_m[0]).fold(0.0,f64::max);
 println!("F {force} H {h}: {dt:.2}s {:.4}s/pt newton {nwt} krylov {kr} unconv {un:?} peak {:.4e} at {:.2} ratio {:.3} open {} energy {:.1e}",dt/pts as f64,pk.observed_amplitude_m[0],pk.frequency_hz,pk.observed_amplitude_m[0]/lin,pk.cycles.iter().filter(|c|c.opens).count(), r.orbits.iter().map(|o|((o.friction_power_w+o.viscous_power_w)/o.input_power_w-1.0).abs()).fold(0.0,f64::max));
}
