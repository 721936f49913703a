//! The diffusion of correlated random walks by script, beside a closed form.

use std::fmt::Write;

use super::check;
use super::walk_model::mean_diffusion;
use crate::script::{folder, run_with};

const WALK: &str = include_str!("../../../examples/study/walk.bzz");

const ROBOTS: usize = 3000;
/// Ticks between two samples.
const SAMPLE: u64 = 500;
/// Samples of lags whose difference gives the slope: 200 and 500 s.
const LAGS: [usize; 2] = [4, 10];

/// The diffusion constant in mm^2/s that 3,000 robots show in 900 s.
fn simulated(rho: f64, bias_deg_s: f64) -> f64 {
    let folder = folder("diffusion", &[("walk.bzz", WALK)]);
    // Robots hardly meet.
    let text = format!(
        "[world]\nsize = [330000, 330000]\nduration = 900\nseed = 1\n\
         [[robots]]\nrobot = \"kilobot\"\nscript = \"walk.bzz\"\ncount = {ROBOTS}\nplacement = \"grid\"\nspacing = 5000\n\
         model = {{ heading_bias = {bias_deg_s} }}\n\
         [[event]]\nat = 0\nset = \"all\"\nglobal = \"RHO\"\nnumber = {:.0}\n",
        100.0 * rho
    );
    let mut paths = vec![Vec::new(); ROBOTS];
    run_with(&folder, &text, 2, |simulation| {
        if simulation.now() % SAMPLE == 0 {
            for (robot, path) in paths.iter_mut().enumerate() {
                let pose = simulation.view(robot).unwrap().pose;
                path.push([pose.x, pose.y].map(f64::from));
            }
        }
    });
    let [short, long] = LAGS.map(|lag| {
        let squares = paths.iter().flat_map(|path| {
            path.iter()
                .zip(&path[lag..])
                .map(|(a, b)| (b[0] - a[0]).powi(2) + (b[1] - a[1]).powi(2))
        });
        let count = ROBOTS * (paths[0].len() - lag);
        squares.sum::<f64>() / count as f64
    });
    let seconds = (LAGS[1] - LAGS[0]) as f64 * SAMPLE as f64 / 10.0;
    (long - short) / (4.0 * seconds)
}

/// Nine cells as in the study after Dimidov, Oriolo, Trianni (ANTS 2016). 3,000 robots know a constant to some 2 %.
#[test]
#[ignore = "takes ten minutes"]
fn walks_diffuse_as_a_closed_form() {
    let mut table = "| rho | bias, degrees per second | simulator | closed form | ratio | point that turns on the spot |\n\
                     |---|---|---|---|---|---|\n"
        .to_owned();
    let mut wrong = Vec::new();
    for rho in [0.0, 0.5, 0.9] {
        for bias in [0.0, 2.0, 6.0] {
            let (found, expected) = (simulated(rho, bias), mean_diffusion(rho, bias, false));
            let point = mean_diffusion(rho, bias, true);
            let ratio = found / expected;
            writeln!(
                table,
                "| {rho} | {bias} | {found:.0} | {expected:.0} | {ratio:.2} | {point:.0} |"
            )
            .unwrap();
            if (ratio - 1.0).abs() > 0.05 {
                wrong.push((rho, bias, ratio));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:?}\n{table}");
    check("diffusion", &table);
}
