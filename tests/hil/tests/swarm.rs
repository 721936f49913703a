//! Robots that hear each other over the radio.

#![allow(clippy::unwrap_used, reason = "a test may")]

use bittybuzz_hil::Swarm;

/// The ground station's pose is the script's `pos`, until it is a second old.
#[test]
fn a_positioning_system_is_believed_for_a_second() {
    let script = "function step() { log(id, pos.x, pos.y, pos.z, pos.orientation) }";
    let mut swarm = Swarm::crazyflies(script, &[7, 0xfffe]);
    swarm.place(0, Some([1500.0, -250.0, 1000.0, 90.0]));
    swarm.run_ms(1000);
    for (member, id) in swarm.members().iter().zip(["7", "65534"]) {
        assert_eq!(member.last_logged().unwrap()[0], id);
    }
    let [x, y, z, degrees] = [1, 2, 3, 4]
        .map(|at| swarm.members()[0].last_logged().unwrap()[at].parse::<f32>().unwrap());
    assert_eq!([x, y, z], [1500.0, -250.0, 1000.0]);
    assert!((degrees - 90.0).abs() < 1e-3, "{degrees}");
    // Nobody tells the other one.
    assert_eq!(swarm.members()[1].last_logged().unwrap()[1..], ["nil"; 4]);
    // The last packet came at 0.9 s or so.
    swarm.place(0, None);
    swarm.run_ms(850);
    assert_eq!(swarm.members()[0].last_logged().unwrap()[1], "1500");
    swarm.run_ms(300);
    assert_eq!(swarm.members()[0].last_logged().unwrap()[1..], ["nil"; 4]);
}

/// What a robot sees of its only neighbour.
const LOOK: &str = "\
function step() {
  neighbors.foreach(function(id, data) { log(id, data.distance, data.azimuth, data.elevation) })
}
";

/// Robot 1 stands at the origin and looks along x, robot 2 is 500 mm away and looks along y: who turns to the left by 90
/// degrees sees everything 90 degrees farther to the right.
#[test]
fn neighbours_see_each_other_in_all_quadrants() {
    for (x, y, bearing) in [
        (300.0, 400.0, 53.130),
        (-300.0, 400.0, 126.870),
        (-300.0, -400.0, -126.870),
        (300.0, -400.0, -53.130),
    ] {
        let mut swarm = Swarm::crazyflies(LOOK, &[1, 2]);
        swarm.place(0, Some([0.0, 0.0, 500.0, 0.0]));
        swarm.place(1, Some([x, y, 500.0, 90.0]));
        swarm.run_ms(3000);
        let opposite = if bearing > 0.0 { bearing - 180.0 } else { bearing + 180.0 };
        let turned = opposite - 90.0_f32;
        let turned = if turned <= -180.0 { turned + 360.0 } else { turned };
        for (member, other, azimuth) in [(0, "2", bearing), (1, "1", turned)] {
            let seen = swarm.members()[member].last_logged().expect("a neighbour");
            assert_eq!(seen[0], other);
            let [distance, at, elevation] = [1, 2, 3].map(|n| seen[n].parse::<f32>().unwrap());
            assert!((distance - 500.0).abs() < 0.1, "{distance} mm");
            assert!(
                (at.to_degrees() - azimuth).abs() < 0.01,
                "{} instead of {azimuth}",
                at.to_degrees()
            );
            assert!(elevation.abs() < 1e-3, "{elevation}");
        }
    }
}

/// Without a position of both there is no distance, but a neighbour.
#[test]
fn without_positions_there_is_no_distance() {
    let mut swarm = Swarm::crazyflies(LOOK, &[1, 2]);
    swarm.run_ms(3000);
    assert_eq!(swarm.members()[0].last_logged().expect("a neighbour"), ["2", "nil", "nil", "nil"]);
    // Only one knows where it is.
    swarm.place(1, Some([100.0, 0.0, 0.0, 0.0]));
    swarm.run_ms(3000);
    assert_eq!(swarm.members()[0].last_logged().unwrap(), ["2", "nil", "nil", "nil"]);
    assert_eq!(swarm.members()[1].last_logged().unwrap(), ["1", "nil", "nil", "nil"]);
}

/// Each proposes its own number; the highest wins on both.
const AGREE: &str = "\
function init() {
  v = stigmergy.create(1)
  v.onconflict(function(key, local, remote) {
    if(remote.data > local.data) return remote
    return local
  })
  v.put(0, 100 + id)
}
function step() { log(v.get(0), v.size()) }
";

fn agreed(swarm: &mut Swarm) -> bool {
    swarm.members().iter().all(|member| {
        assert!(member.told.records.is_empty(), "{:?}", member.told.records);
        member.last_logged().is_some_and(|values| values == ["107", "1"])
    })
}

#[test]
fn two_robots_agree() {
    let mut swarm = Swarm::crazyflies(AGREE, &[3, 7]);
    swarm.run_ms(2000);
    assert!(agreed(&mut swarm), "{:?}", swarm.members()[0].told.log);
}

#[test]
fn two_robots_agree_though_most_frames_are_lost() {
    let mut swarm = Swarm::crazyflies(AGREE, &[3, 7]);
    swarm.lose(0.7, 42);
    swarm.run_ms(30_000);
    assert!(swarm.lost * 2 > swarm.on_air, "{} of {}", swarm.lost, swarm.on_air);
    assert!(agreed(&mut swarm), "{:?}", swarm.members()[0].told.log.last());
}
