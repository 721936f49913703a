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
