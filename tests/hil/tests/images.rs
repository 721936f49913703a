//! Robots of a scenario that run a foreign image, without a script. The image here is this project's
//! firmware, which echoes packets of ground stations.

use std::net::UdpSocket;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use bittybuzz_arena::run::{Program, Setup, Simulation};
use bittybuzz_arena::scenario::Scenario;
use bittybuzz_hil::{Core, crazyflie};

/// A packet of CRTP's link echo: port 15, channel 0.
const ECHO: [u8; 3] = [0xf0, 7, 8];

/// Two robots with this group, before their first tick; an error as `line: message`.
fn simulation(group: &str) -> Result<Simulation, String> {
    let text = format!(
        "[world]\nsize = [2000, 2000]\nduration = 600\n[[robots]]\nrobot = \"crazyflie\"\nbackend = \"firmware\"\n\
         image = '{}'\npositions = [[300, -200], [-400, 100]]\nheading = 90\n{group}\n",
        crazyflie().display()
    );
    let scenario =
        Scenario::parse(&text, "test.toml", "".as_ref(), &[], &bittybuzz_robot_models::all());
    let scenario = scenario.unwrap_or_else(|errors| panic!("{errors:#?}"));
    let programs: Vec<Program> = scenario.groups.iter().map(Program::empty).collect();
    let setup = Setup::new(scenario, programs).unwrap_or_else(|error| panic!("{error:#?}"));
    let setup = setup.emulated_by("crazyflie", Core::Unicorn.program().to_owned());
    Simulation::new(Arc::new(setup), 1, 1)
        .map_err(|error| format!("{}: {error}", error.place.as_ref().unwrap().line))
}

/// Returns two ports, one after the other, that nobody uses.
fn free_ports() -> u16 {
    loop {
        let first = UdpSocket::bind("127.0.0.1:0").unwrap();
        let port = first.local_addr().unwrap().port();
        if port < u16::MAX && UdpSocket::bind(("127.0.0.1", port + 1)).is_ok() {
            return port;
        }
    }
}

fn run(simulation: &mut Simulation, ticks: u64) {
    while simulation.now() < ticks {
        simulation.tick().unwrap_or_else(|error| panic!("{error}"));
    }
}

/// Without doors nothing from outside is let in, so that runs are equal although the robots'
/// emulators run at the same time.
#[test]
fn robots_stand_at_their_places_in_every_run() {
    let [first, second] = [(), ()].map(|()| {
        let mut simulation = simulation("").unwrap();
        run(&mut simulation, 15);
        for (number, place) in [[300.0, -200.0], [-400.0, 100.0]].into_iter().enumerate() {
            let pose = simulation.view(number).unwrap().pose;
            let away = (pose.x - place[0]).hypot(pose.y - place[1]);
            // As in a virtual machine, a robot on the floor has height 0.
            assert!(away < 1.0 && pose.z < 1.0, "{pose:?}");
            assert!((pose.heading.to_degrees() - 90.0).abs() < 1.0, "{pose:?}");
        }
        assert_eq!(simulation.take_log(), [], "the image breaks no rule of the chip");
        simulation.digest()
    });
    assert_eq!(first, second);
}

#[test]
fn a_ground_station_reaches_each_robot_through_its_door() {
    let port = free_ports();
    let mut simulation = simulation(&format!("door = {port}")).unwrap();
    let is_over = AtomicBool::new(false);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            while !is_over.load(Ordering::Relaxed) && !simulation.is_over() {
                simulation.tick().unwrap_or_else(|error| panic!("{error}"));
            }
        });
        // The robots start, and let packets in once their links are up.
        for robot in [1, 0] {
            let station = UdpSocket::bind("127.0.0.1:0").unwrap();
            station.connect(("127.0.0.1", port + robot)).unwrap();
            station.set_read_timeout(Some(Duration::from_millis(200))).unwrap();
            let packet = [ECHO[0], ECHO[1], robot as u8];
            let mut answer = [0; 32];
            let echo = std::iter::repeat_with(|| {
                station.send(&packet).unwrap();
                station.recv(&mut answer).ok().map(|length| answer[..length].to_vec())
            });
            // A run that has failed answers no more.
            let mut others = echo.take(3000).filter(|answer| answer.as_deref() == Some(&packet));
            assert!(others.next().is_some(), "robot {robot}");
        }
        is_over.store(true, Ordering::Relaxed);
    });
}

#[test]
fn a_door_at_a_port_in_use_is_an_error_at_its_key() {
    let port = free_ports();
    let taken = UdpSocket::bind(("127.0.0.1", port + 1)).unwrap();
    let error = simulation(&format!("door = {port}")).err().unwrap();
    drop(taken);
    let expected =
        format!("10: robot 1 gets no door: no door can be opened at port {}: ", port + 1);
    assert!(error.starts_with(&expected), "{error}");
}
