//! Infrared as the validation files of argos3-kilobot have it (Pinciroli et al., ANTS 2018): series tau 0, tau 0.25, tau 0.5.

use crate::common::robots::{Settings, World};
use crate::common::*;
use bittybuzz_arena::engine::{Area, InfraredPreset, Medium, RobotId};
use bittybuzz_kilobot_model::Preset;

/// Pairs at each distance.
const PAIRS: usize = 20;

/// Returns the shares of frames that arrive at these distances between centers, in mm, and the number of frames sent per
/// second. Pairs do not reach each other.
fn reception(settings: Settings, centers_mm: &[f32], seconds: u64) -> (Vec<f32>, f32) {
    let area = Area { width: 1000.0 * centers_mm.len() as f32, height: 1000.0 * PAIRS as f32 };
    let mut world = World::new(Settings { area, ..settings }).unwrap();
    let mut pairs = Vec::new();
    for (column, mm) in centers_mm.iter().enumerate() {
        for row in 0..PAIRS {
            let x = 1000.0 * column as f32 - area.width / 2.0 + 100.0;
            let y = 1000.0 * row as f32 - area.height / 2.0 + 500.0;
            let speaker = kilobot(&mut world, x, y, 0.0, Probe::talking());
            pairs.push((speaker, kilobot(&mut world, x + mm, y, 0.0, Probe::default())));
        }
    }
    run(&mut world, 10 * seconds);
    let sent = world.statistics().link(Medium::Infrared).sent as f32;
    drain(&mut world);
    let share = |pairs: &[(RobotId, RobotId)]| {
        let received = |(from, to): &(RobotId, RobotId)| probe(&world, *to).received_from(*from);
        let given = |(from, _): &(RobotId, RobotId)| probe(&world, *from).given as usize;
        let sum = |of: &dyn Fn(&(RobotId, RobotId)) -> usize| pairs.iter().map(of).sum::<usize>();
        sum(&received) as f32 / sum(&given) as f32
    };
    (pairs.chunks(PAIRS).map(share).collect(), sent / (pairs.len() as u64 * seconds) as f32)
}

fn standard(seed: u64) -> Settings {
    Settings { seed, ..Settings::default() }
}

/// Least and greatest share of the three series. 20 pairs of 570 frames know a share of 0.96 to 0.002.
#[test]
fn reception_is_within_the_published_series() {
    let published = [(0.956, 0.971), (0.932, 0.965), (0.919, 0.960)];
    let (found, rate) = reception(standard(1), &[50.0, 70.7, 100.0], 300);
    for ((least, most), share) in published.into_iter().zip(&found) {
        assert!((least..=most).contains(share), "{found:?}");
    }
    // 298.3 frames in 4,800 ticks of 32.768 ms.
    close(rate, 1.897, 0.03);
}

/// The series tau 0.25 and tau 0.5 have 0.78 and 0.79 at 141 mm, 0.14 and 0.15 at 158 mm, and 0.02 at 180 mm. From 90 to 10 % of
/// the level, the edge is 20 mm wide.
#[test]
fn the_edge_is_20_mm_wide() {
    let (shares, _) = reception(standard(2), &[141.4, 158.1, 180.3], 200);
    close(shares[0], 0.785, 0.06);
    close(shares[1], 0.145, 0.06);
    close(shares[2], 0.02, 0.03);
    let level = 1.0 - standard(1).infrared.link.loss.near;
    let (shares, _) = reception(standard(3), &[140.0, 150.0, 160.0], 300);
    for (share, expected) in shares.into_iter().zip([0.9, 0.5, 0.1]) {
        close(share / level, expected, 0.02);
    }
}

/// A range beyond 180 mm, as in the series tau 0; the makers' figure; and the sharp ends of the simulators.
#[test]
fn presets_have_the_ranges_of_their_sources() {
    let shares = |preset: InfraredPreset| {
        let mut settings = standard(4);
        settings.infrared.link = preset.link();
        reception(settings, &[70.7, 100.0, 180.3, 200.0], 100).0
    };
    let long = shares(InfraredPreset::Ants2018Long);
    close(long[2], 0.932, 0.03);
    close(long[3], 0.51, 0.05);
    let icra = shares(InfraredPreset::Icra2012);
    close(icra[0], 0.958, 0.01);
    close(icra[1], 0.48, 0.03);
    assert_eq!(icra[2..], [0.0, 0.0]);
    for (preset, range) in
        [(Preset::Kilombo, 70.0), (Preset::Argos, 100.0), (Preset::Kilosim, 96.0)]
    {
        let mut settings = standard(5);
        settings.preset(preset);
        let (shares, _) = reception(settings, &[range - 0.1, range + 0.1], 20);
        assert_eq!(shares, [1.0, 0.0], "{preset:?}");
    }
}

/// Who cannot receive a frame does not sense it either: two at the end of the range postpone as rarely as they receive.
#[test]
fn dim_frames_are_not_sensed() {
    let postponed = [60.0, 117.0, 160.0].map(|gap| {
        let mut sum = 0;
        for seed in 0..30 {
            let mut settings = busy(seed);
            settings.infrared.link.range = Some(117.0);
            settings.infrared.link.edge = 10.0;
            let mut world = World::new(settings).unwrap();
            kilobot(&mut world, 0.0, 0.0, 0.0, Probe::talking());
            kilobot(&mut world, 33.0 + gap, 0.0, 0.0, Probe::talking());
            run(&mut world, 300);
            let link = world.statistics().link(Medium::Infrared);
            sum += link.postponed;
            // Two frames overlap only if neither was sensed, and then both robots miss one.
            assert_eq!(link.collided, 0);
        }
        sum as f32
    });
    assert!(postponed[0] > 200.0, "{postponed:?}");
    close(postponed[1] / postponed[0], 0.5, 0.12);
    assert_eq!(postponed[2], 0.0);
}

/// The chances of a frame are those of the run, whatever is observed, and other ones with another seed.
#[test]
fn chances_do_not_depend_on_observation() {
    let of = |seed, is_watched: bool| {
        let mut world = World::new(standard(seed)).unwrap();
        for i in 0..10 {
            kilobot(
                &mut world,
                (i % 5) as f32 * 145.0,
                (i / 5) as f32 * 150.0,
                0.0,
                Probe::talking(),
            );
        }
        for _ in 0..200 {
            if is_watched {
                world.watch();
            }
            world.tick();
            world.take_frame_log();
        }
        (world.digest(), world.brains().map(|probe| probe.received.len()).sum::<usize>())
    };
    assert_eq!(of(1, false), of(1, true));
    assert_ne!(of(1, false), of(2, false));
}
