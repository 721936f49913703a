//! Four images dance at 5 % packet loss, and stay apart.

use super::fresh::{numbers, print_count};
use crate::flight_examples::{APART_MM, fly};

#[test]
#[ignore = "`cargo xtask soak image_flights` runs it"]
fn robots_stay_apart_in_fresh_seeds() {
    let seeds = numbers();
    for seed in seeds.clone() {
        let seed_key = format!("world.seed={seed}");
        let least_mm = fly("examples/flight/exhibition.toml", &[seed_key]);
        println!("figure: mm between the nearest robots = {least_mm:.0} in flight {seed}");
        assert!(least_mm > APART_MM, "seed {seed}: {least_mm} mm");
    }
    print_count("seeds", seeds.len());
}
