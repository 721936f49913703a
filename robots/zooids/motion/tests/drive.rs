//! Simulated robots with two wheels, a dead band and different motors drive to goals under a
//! projector.

use crate::common::{Light, Robot, Truth};
use bittybuzz_motion::drive::{Goal, Pilot, Wheels};
use bittybuzz_random::Random;

/// The body of a robot: 20 mm between the wheels, 0.5 m/s at 60 percent, no movement up to `dead`
/// percent, and a gain for each wheel.
struct Body {
    truth: Truth,
    dead: f64,
    gains: [f64; 2],
    wheels: Wheels,
}

impl Body {
    fn step(&mut self, seconds: f64) {
        let speed = |duty: i8, gain: f64| {
            let effort = (f64::from(duty).abs() - self.dead).clamp(0.0, 60.0 - self.dead);
            f64::from(duty).signum() * gain * 500.0 * effort / (60.0 - self.dead)
        };
        let left = speed(self.wheels.left, self.gains[0]);
        let right = speed(self.wheels.right, self.gains[1]);
        self.truth.heading += (right - left) / 20.0 * seconds;
        let along = (left + right) / 2.0 * seconds;
        self.truth.x += along * self.truth.heading.cos();
        self.truth.y += along * self.truth.heading.sin();
    }
}

/// Drives for at most `seconds` seconds. Returns the time at which the robot reported its arrival
/// (not before it stood), and its distance from the goal half a second later.
fn drive(body: &mut Body, pilot: &mut Pilot, goal: [f64; 2], seconds: f64) -> (Option<f64>, f64) {
    let goal_mm = goal;
    let goal = Goal { x: (goal[0] * 16.0) as i32, y: (goal[1] * 16.0) as i32 };
    let (mut light, mut robot) = (Light::new(0.01, 20.0, 11), Robot::new());
    pilot.depart();
    let (mut there, mut step) = (None, 0);
    loop {
        step += 1;
        let time = f64::from(step) * 9e-6;
        let now = (time * 1e6) as u32 + 100;
        light.step(time, body.truth).into_iter().for_each(|edge| robot.edge(edge));
        if robot.task(now).is_some()
            && let Some(pose) = robot.tracker.pose(now)
        {
            body.wheels = pilot.steer(goal, &pose, now);
            if goal.is_reached(&pose) {
                there.get_or_insert(time);
            }
        }
        body.step(9e-6);
        if time > there.map_or(seconds, |there| there + 0.5) {
            let off = (body.truth.x - goal_mm[0]).hypot(body.truth.y - goal_mm[1]);
            return (there, off);
        }
    }
}

fn body(noise: &mut Random) -> Body {
    let truth = Truth {
        x: 300.0 * (noise.unit() - 0.5),
        y: 200.0 * (noise.unit() - 0.5),
        heading: 6.3 * noise.unit(),
    };
    let gains = [0.95 + 0.1 * noise.unit(), 0.95 + 0.1 * noise.unit()];
    Body { truth, dead: 22.0, gains, wheels: Wheels::default() }
}

#[test]
fn a_robot_reaches_goals_in_all_directions() {
    let mut noise = Random::new(42);
    let (mut worst, mut slowest, mut sum) = (0.0_f64, 0.0_f64, 0.0);
    for _ in 0..60 {
        let mut body = body(&mut noise);
        let goal = [400.0 * (noise.unit() - 0.5), 300.0 * (noise.unit() - 0.5)];
        let way = (body.truth.x - goal[0]).hypot(body.truth.y - goal[1]);
        let (there, off) = drive(&mut body, &mut Pilot::new(Some(22)), goal, 8.0);
        let there = there.expect("it arrives");
        // The robot needs at most 2 s more than at 150 mm/s.
        assert!(there < 2.0 + way / 150.0, "{there} s for {way} mm");
        assert!(off < 5.5, "{off} mm");
        worst = worst.max(off);
        slowest = slowest.max(there - way / 150.0);
        sum += off;
        assert_eq!(body.wheels, Wheels::default(), "it stands");
    }
    println!("off by {:.2} mm on average, {worst:.2} at most; {slowest:.2} s", sum / 60.0);
}

/// The minimum duty of unknown motors is measured on the way, for any dead band.
#[test]
fn the_minimum_duty_is_found_while_driving() {
    let mut noise = Random::new(7);
    for dead in [15.0, 22.0, 25.0, 30.0, 38.0] {
        let mut body = Body { dead, ..body(&mut noise) };
        let mut pilot = Pilot::new(None);
        let (there, off) = drive(&mut body, &mut pilot, [50.0, 20.0], 10.0);
        assert!(there.is_some() && off < 6.5, "dead band {dead}: {there:?}, {off} mm");
        let minimum = f64::from(pilot.minimum().expect("known by now"));
        assert!(minimum >= 22.0 && minimum < dead.max(21.0) + 4.0, "{minimum} for {dead}");
    }
}

/// The search ends for a robot that is held or has no motors.
#[test]
fn the_search_ends() {
    let mut noise = Random::new(7);
    let mut body = Body { gains: [0.0; 2], ..body(&mut noise) };
    let mut pilot = Pilot::new(None);
    assert_eq!(drive(&mut body, &mut pilot, [200.0, 200.0], 5.0).0, None);
    assert_eq!(pilot.minimum(), Some(22));
}

/// A robot at its goal that is pushed a little stays there; one that is pushed farther comes back.
#[test]
fn a_robot_at_its_goal_stays() {
    let mut noise = Random::new(9);
    let mut body = body(&mut noise);
    let mut pilot = Pilot::new(Some(22));
    let goal = [10.0, 10.0];
    drive(&mut body, &mut pilot, goal, 8.0);
    body.truth.x += 60.0;
    let mut again = pilot;
    let (there, off) = drive(&mut body, &mut again, goal, 8.0);
    assert!(there.is_some() && off < 5.5, "{off} mm");
}
