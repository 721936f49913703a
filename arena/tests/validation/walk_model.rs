//! A closed form of the diffusion of a Kilobot's correlated random walk, in which nothing is simulated.
//!
//! A cycle of the walk is an arc and a turn about a leg. In the complex plane, a cycle moves the robot by `d` in its own frame and
//! turns it by `t`; both depend on the drawn angle. With `l = E[exp(i t)]`, after n cycles the mean square displacement grows by
//!
//! `E|d|^2 + 2 Re sum over k of E[conj(d) exp(i t)] l^(k - 1) g(k) E[d]`
//!
//! per cycle, where g(k) is the loss of correlation by the heading noise (an Ornstein-Uhlenbeck process, integrated over k cycles).
//! A quarter of it by the mean time of a cycle is the diffusion constant of a robot. The mean over all robots is an integral over
//! their constant errors: speed, bias and the gains of both motors.
//!
//! Figures: 10 mm/s with 13 %, 45 degrees per second with 10 %, legs 25 mm apart and 9.2 mm behind the middle, bias by parameter,
//! noise of 1 degree per second with a time of 10 s.

use std::f64::consts::{PI, TAU};
use std::ops::{Add, Mul};

#[derive(Clone, Copy, Debug, PartialEq)]
struct Complex(f64, f64);

impl Complex {
    fn turn(angle: f64) -> Self {
        Complex(angle.cos(), angle.sin())
    }

    fn conj(self) -> Self {
        Complex(self.0, -self.1)
    }

    fn scaled(self, by: f64) -> Self {
        Complex(self.0 * by, self.1 * by)
    }
}

impl Add for Complex {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Complex(self.0 + other.0, self.1 + other.1)
    }
}

impl Mul for Complex {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        Complex(self.0 * other.0 - self.1 * other.1, self.0 * other.1 + self.1 * other.0)
    }
}

/// Seconds straight on, and seconds of a step.
const STRAIGHT: f64 = 2.6;
const STEP: f64 = 0.1;
/// Steps of a turn by pi at 45 degrees per second.
const HALF_TURN: i32 = 40;

/// Constant errors of a robot.
#[derive(Clone, Copy, Debug)]
struct Build {
    speed: f64,
    bias: f64,
    gains: [f64; 2],
}

/// The probability that a turn takes `steps` (negative to the right): a wrapped Cauchy distribution, rounded.
fn probability(rho: f64, steps: i32) -> f64 {
    // The distribution function of the angle, from 0 at -pi to 1 at pi.
    let below = |steps: f64| {
        let angle = (steps * PI / f64::from(HALF_TURN)).clamp(-PI, PI);
        0.5 + ((1.0 + rho) / (1.0 - rho) * (angle / 2.0).tan()).atan() / PI
    };
    below(f64::from(steps) + 0.5) - below(f64::from(steps) - 0.5)
}

/// The diffusion constant of a robot in mm^2/s.
fn diffusion(rho: f64, Build { speed, bias, gains }: Build, is_point: bool) -> f64 {
    let arc = |seconds: f64| {
        let angle = bias * seconds;
        if angle.abs() < 1e-9 {
            return (Complex(speed * seconds, 0.0), angle);
        }
        // The integral of speed * exp(i bias t).
        let Complex(cos, sin) = Complex::turn(angle);
        (Complex(sin, 1.0 - cos).scaled(speed / bias), angle)
    };
    let (mut d, mut l, mut mixed) = (Complex(0.0, 0.0), Complex(0.0, 0.0), Complex(0.0, 0.0));
    let (mut square, mut seconds, mut turning) = (0.0, 0.0, 0.0);
    for steps in -HALF_TURN..=HALF_TURN {
        let p = probability(rho, steps);
        // Without a turn, the motors go on for the step in which it was drawn.
        let (way, angle) = arc(if steps == 0 { STRAIGHT + STEP } else { STRAIGHT });
        let side = f64::from(steps.signum());
        let gain = gains[usize::from(steps < 0)];
        let turn = f64::from(steps) * STEP * PI / 4.0 * gain;
        // The leg on the side to which the robot turns stays at its place.
        let leg = Complex(-9.2, 12.5 * side);
        let about = leg + (leg * Complex::turn(turn)).scaled(-1.0);
        let about = if steps == 0 || is_point { Complex(0.0, 0.0) } else { about };
        let way = way + Complex::turn(angle) * about;
        let rotation = Complex::turn(angle + turn);
        d = d + way.scaled(p);
        l = l + rotation.scaled(p);
        mixed = mixed + (way.conj() * rotation).scaled(p);
        square += p * (way.0 * way.0 + way.1 * way.1);
        let turning_seconds = f64::from(steps.abs().max(1)) * STEP;
        seconds += p * (STRAIGHT + turning_seconds);
        turning += if steps == 0 { 0.0 } else { p * turning_seconds };
    }
    // The noise acts on the whole arc, and with half of its variance on a turn.
    let (sigma, tau) = (1_f64.to_radians(), 10.0);
    let share = (seconds - turning / 2.0) / seconds;
    let correlation = |cycles: f64| {
        let t = cycles * seconds;
        let variance = 2.0 * sigma * sigma * share * tau * (t - tau * (1.0 - (-t / tau).exp()));
        (-variance / 2.0).exp()
    };
    let (mut power, mut sum) = (Complex(1.0, 0.0), Complex(0.0, 0.0));
    for k in 1..2000 {
        sum = sum + power.scaled(correlation(f64::from(k)));
        power = power * l;
    }
    let growth = square + 2.0 * (mixed * sum * d).0;
    growth / (4.0 * seconds)
}

/// Equal parts of a normal distribution within three deviations, as in the simulator.
fn normal(parts: usize) -> Vec<(f64, f64)> {
    let width = 6.0 / parts as f64;
    let density = |x: f64| (-x * x / 2.0).exp() / TAU.sqrt() * width;
    let middles = (0..parts).map(|part| -3.0 + width * (part as f64 + 0.5));
    let parts: Vec<_> = middles.map(|x| (x, density(x))).collect();
    let sum: f64 = parts.iter().map(|(_, weight)| weight).sum();
    parts.into_iter().map(|(x, weight)| (x, weight / sum)).collect()
}

/// Returns the mean diffusion constant in mm^2/s of Kilobots with that concentration of turn angles and that deviation of the bias
/// in degrees per second; `is_point` is a point that turns on the spot.
pub fn mean_diffusion(rho: f64, bias_deg_s: f64, is_point: bool) -> f64 {
    let biases = if bias_deg_s > 0.0 { normal(120) } else { vec![(0.0, 1.0)] };
    let few = normal(8);
    let mut sum = 0.0;
    for (bias, weight) in &biases {
        let bias = bias_deg_s.to_radians() * bias;
        for (speed, of_speed) in &few {
            for (left, of_left) in &few {
                for (right, of_right) in &few {
                    let gains = [1.0 + 0.1 * left, 1.0 + 0.1 * right];
                    let build = Build { speed: 10.0 * (1.0 + 0.13 * speed), bias, gains };
                    let share = weight * of_speed * of_left * of_right;
                    if share > 1e-7 {
                        sum += share * diffusion(rho, build, is_point);
                    }
                }
            }
        }
    }
    sum
}

/// The mean cosine of a wrapped Cauchy distribution is rho.
#[test]
fn turns_have_the_mean_cosine_of_their_distribution() {
    for rho in [0.0, 0.5, 0.9] {
        let all = (-HALF_TURN..=HALF_TURN).map(|steps| {
            let angle = f64::from(steps) * PI / f64::from(HALF_TURN);
            (probability(rho, steps), angle.cos())
        });
        let (sum, cosine) = all.fold((0.0, 0.0), |(sum, mean), (p, cos)| (sum + p, mean + p * cos));
        assert!((sum - 1.0).abs() < 1e-9, "{rho}: {sum}");
        assert!((cosine - rho).abs() < 0.01, "{rho}: {cosine}");
    }
}
