//! The random number generator against a model in wide integers, and its distributions.

use crate::number::binary32::{pack, unpack_in};
use bittybuzz_vm_core::number::{Full, Profile, Rng, Tiny};

/// The generator's distributions as binary32.
trait Distributions {
    fn uniform<P: Profile>(&mut self, a: f32, b: f32) -> f32;
    fn between(&mut self, a: i32, b: i32) -> i32;
    fn normal(&mut self, deviation: f32, mean: f32) -> f32;
    fn decay(&mut self, mean: f32) -> f32;
}

impl Distributions for Rng {
    fn uniform<P: Profile>(&mut self, a: f32, b: f32) -> f32 {
        let mut number = unpack_in::<P>(a);
        self.uniform_float(&mut number, &unpack_in(b));
        pack(&number)
    }

    fn between(&mut self, a: i32, b: i32) -> i32 {
        self.uniform_int::<Full>(a as u32, b as u32) as i32
    }

    fn normal(&mut self, deviation: f32, mean: f32) -> f32 {
        let mut number = unpack_in::<Full>(deviation);
        self.gaussian::<_, &[u8]>(&mut number, &unpack_in(mean));
        number.to_f32()
    }

    fn decay(&mut self, mean: f32) -> f32 {
        let mut number = unpack_in::<Full>(mean);
        self.exponential::<_, &[u8]>(&mut number);
        number.to_f32()
    }
}

/// The documented generator, in words of 64 bits.
struct Model {
    state: u64,
    increment: u64,
}

const MODULUS: u64 = 1 << 32;

fn mixed(word: u64) -> u64 {
    let word = (word ^ (word >> 16)) * 0x85EB_CA6B % MODULUS;
    let word = (word ^ (word >> 13)) * 0xC2B2_AE35 % MODULUS;
    word ^ (word >> 16)
}

impl Model {
    fn new(seed: u32, id: u16) -> Model {
        let state = mixed(u64::from(seed) ^ mixed(u64::from(id) + 0x9E37_79B9));
        let increment = mixed((state + 0x9E37_79B9) % MODULUS);
        Model { state, increment: increment / 2 * 2 + 1 }
    }

    fn next(&mut self) -> u32 {
        self.state = (self.state + self.increment) % MODULUS;
        mixed(self.state) as u32
    }
}

#[test]
fn the_documented_algorithm() {
    for seed in [0, 1, 2, 42, 0xFFFF_FFFF, 0x8000_0000, 123_456_789] {
        for id in [0, 1, 2, 258, 65535] {
            let (mut rng, mut model) = (Rng::new(seed, id), Model::new(seed, id));
            for _ in 0..1000 {
                assert_eq!(rng.next_u32(), model.next(), "seed {seed} robot {id}");
            }
        }
        assert_eq!(Rng::from_seed(seed), Rng::new(seed, 0));
    }
}

#[test]
fn the_finalizer_is_the_published_one() {
    // MurmurHash3 of no bytes is the finalizer of the seed; values of its reference implementation.
    assert_eq!(mixed(0), 0);
    assert_eq!(mixed(1), 0x514E_28B7);
    assert_eq!(mixed(0xFFFF_FFFF), 0x81F1_6F39);
}

#[test]
fn no_robot_repeats_another() {
    let mut seen = std::collections::HashSet::new();
    for id in 0..1000 {
        let mut rng = Rng::new(77, id);
        assert!(seen.insert([rng.next_u32(), rng.next_u32()]), "robot {id}");
        assert!((0..20).any(|_| rng.next_u32() != 0));
    }
    // Equal bits of consecutive robots, and of a robot's consecutive numbers: half of them.
    let (mut between, mut within) = (0, 0);
    for id in 0..500 {
        let (mut one, mut other) = (Rng::new(5, id), Rng::new(5, id + 1));
        let mut last = one.next_u32();
        for _ in 0..20 {
            let number = one.next_u32();
            between += (number ^ other.next_u32()).count_ones();
            within += (number ^ last).count_ones();
            last = number;
        }
    }
    // Of 320,000 bits; the deviation is 283.
    assert!(between.abs_diff(160_000) < 1200, "{between}");
    assert!(within.abs_diff(160_000) < 1200, "{within}");
}

#[test]
fn integers_stay_in_their_range() {
    let mut rng = Rng::new(1, 1);
    for (a, b) in [
        (0, 1),
        (0, 10),
        (-5, 5),
        (5, -5),
        (-32768, 32767),
        (i32::MIN, i32::MAX),
        (i32::MAX, i32::MIN),
        (7, 8),
        (-1, 0),
    ] {
        for _ in 0..1000 {
            let value = rng.between(a, b);
            assert!(value >= a.min(b) && value < a.max(b), "{value} of {a}, {b}");
        }
    }
    assert_eq!(rng.between(9, 9), 9);
    // The tiny profile scales the same bits.
    for (a, b) in [(0_i16, 1_i16), (-5, 5), (5, -5), (-32768, 32767), (7, 8), (9, 9)] {
        for _ in 0..1000 {
            let mut other = rng;
            let int = other.uniform_int::<Tiny>(a as u16, b as u16) as i16;
            assert_eq!(i32::from(int), rng.between(a.into(), b.into()));
        }
    }
    for _ in 0..10_000 {
        assert!((0..=32767).contains(&rng.rand()));
    }
}

/// Pearson's statistic of counts that should be equal.
fn unevenness(counts: &[u32]) -> f64 {
    let expected = f64::from(counts.iter().sum::<u32>()) / counts.len() as f64;
    counts.iter().map(|&count| (f64::from(count) - expected).powi(2) / expected).sum()
}

#[test]
fn integers_are_evenly_distributed() {
    let mut rng = Rng::new(2, 3);
    for size in [2_usize, 3, 6, 10, 100] {
        let mut counts = vec![0; size];
        for _ in 0..20_000 * size {
            let value = rng.between(-3, size as i32 - 3) + 3;
            counts[value as usize] += 1;
        }
        // Mean size - 1, variance twice that: four deviations.
        let limit = (size - 1) as f64 + 4.0 * (2.0 * (size - 1) as f64).sqrt();
        assert!(unevenness(&counts) < limit, "{size}: {} {counts:?}", unevenness(&counts));
    }
    let mut bits = [0_u32; 32];
    for _ in 0..100_000 {
        let value = rng.next_u32();
        bits.iter_mut().enumerate().for_each(|(place, count)| *count += value >> place & 1);
    }
    // Deviation 158.
    assert!(bits.iter().all(|&count| count.abs_diff(50_000) < 650), "{bits:?}");
}

fn check_floats<P: Profile>() {
    let mut rng = Rng::new(4, 5);
    for (a, b) in [
        (0.0, 1.0),
        (-1.0, 1.0),
        (1.0, -1.0),
        (100.0, 100.5),
        (1.0, 1.002),
        (-2e9, 2e9),
        (1e-8, 1.0),
        (0.0, 1e-8),
    ] {
        let (a, b) = (P::float_to_f32(P::float_from_f32(a)), P::float_to_f32(P::float_from_f32(b)));
        for _ in 0..3000 {
            let value = rng.uniform::<P>(a, b);
            assert!(value >= a.min(b) && value < a.max(b), "{} {value} of {a}, {b}", P::NAME);
            assert_eq!(P::float_to_f32(P::float_from_f32(value)), value);
        }
    }
    assert_eq!(rng.uniform::<P>(2.5, 2.5), 2.5);
    let mut counts = [0; 20];
    let mut sum = 0.0;
    for _ in 0..100_000 {
        let value = f64::from(rng.uniform::<P>(-1.0, 1.0));
        counts[((value + 1.0) * 10.0) as usize] += 1;
        sum += value;
    }
    assert!(unevenness(&counts) < 45.0, "{} {counts:?}", P::NAME);
    // Deviation of the mean 0.0018.
    assert!((sum / 100_000.0).abs() < 0.008, "{sum}");
}

#[test]
fn floats_stay_in_their_range_and_are_even() {
    check_floats::<Tiny>();
    check_floats::<Full>();
    let mut rng = Rng::new(6, 7);
    for _ in 0..1000 {
        let value = rng.uniform::<Full>(f32::MIN, f32::MAX);
        assert!(value.is_finite());
    }
    assert!(rng.uniform::<Full>(f32::NAN, 1.0).is_nan());
    assert_eq!(rng.uniform::<Full>(3.0, f32::NAN), 3.0);
}

/// Mean, deviation, and the part of `samples` above `threshold`.
fn moments(samples: &[f64], threshold: f64) -> (f64, f64, f64) {
    let count = samples.len() as f64;
    let mean = samples.iter().sum::<f64>() / count;
    let variance = samples.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / count;
    let above = samples.iter().filter(|&&x| x > threshold).count() as f64;
    (mean, variance.sqrt(), above / count)
}

#[test]
fn normal_distribution() {
    let mut rng = Rng::new(8, 9);
    let samples: Vec<_> = (0..200_000).map(|_| f64::from(rng.normal(2.0, 10.0))).collect();
    let (mean, deviation, above) = moments(&samples, 12.0);
    assert!((mean - 10.0).abs() < 0.02, "{mean}");
    assert!((deviation - 2.0).abs() < 0.015, "{deviation}");
    // One deviation above the mean: 15.87 %.
    assert!((above - 0.1587).abs() < 0.004, "{above}");
    let (_, _, above) = moments(&samples, 10.0 + 2.0 * 3.0);
    assert!((above - 0.00135).abs() < 0.0004, "{above}");
    assert_eq!(rng.normal(0.0, 3.5), 3.5);
}

#[test]
fn exponential_distribution() {
    let mut rng = Rng::new(10, 11);
    let samples: Vec<_> = (0..200_000).map(|_| f64::from(rng.decay(3.0))).collect();
    assert!(samples.iter().all(|&x| x > 0.0 && x < 51.0));
    let (mean, deviation, above) = moments(&samples, 3.0);
    assert!((mean - 3.0).abs() < 0.03, "{mean}");
    assert!((deviation - 3.0).abs() < 0.06, "{deviation}");
    // Above the mean: 1/e.
    assert!((above - 0.3679).abs() < 0.005, "{above}");
}

#[test]
fn transformations_are_the_documented_ones() {
    let (mut rng, mut model) = (Rng::new(12, 13), Model::new(12, 13));
    for _ in 0..10_000 {
        let result = f64::from(rng.normal(1.0, 0.0));
        let exact = loop {
            let bits = model.next();
            let (x, y) = (f64::from(bits as i16), f64::from((bits >> 16) as i16));
            let (x, y) = (x / 32768.0, y / 32768.0);
            let s = x * x + y * y;
            if x != 0.0 && s < 1.0 {
                break x * (-2.0 * s.ln() / s).sqrt();
            }
        };
        assert!((result - exact).abs() <= 1e-6 * exact.abs(), "{result} {exact}");
        let result = f64::from(rng.decay(1.0));
        let exact = -(f64::from((model.next() >> 8).max(1)) / 2f64.powi(24)).ln();
        assert!((result - exact).abs() <= 1e-6 * exact, "{result} {exact}");
    }
}
