//! Events about single robots that follow each sample: memory and attitude.

use bittybuzz_arena::engine::{Attitude, Pose};
use bittybuzz_arena::robot::BatteryState;
use bittybuzz_inspect::Inspection;

use super::{INSPECTION_LIMITS, Live};
use crate::faults;
use crate::page_event::{
    AttitudeDescription, AttitudesEvent, BatteryDescription, InspectionEvent, PageEvent,
};

impl Live {
    pub(super) fn add_inspection(&mut self) {
        let Some(robot) = self.inspected else { return };
        let run = self.session.run();
        let content = |content: &Inspection| faults::content(run.setup(), content);
        let memory = run.inspect(robot, INSPECTION_LIMITS).as_ref().map(content);
        let last = run.post_mortem(robot);
        let describe = |last| faults::describe(run.setup(), self.drafts.as_ref(), robot, last);
        let event = InspectionEvent {
            robot,
            tick: run.now(),
            memory,
            fault: last.map(describe),
            at_fault: last.and_then(|last| last.content.as_deref()).map(content),
            battery: run.battery(robot).map(|BatteryState { millivolts, charge }| {
                BatteryDescription { millivolts, charge }
            }),
            estimate: run.view(robot).and_then(|view| view.estimate).map(place),
        };
        self.events.push(PageEvent::Inspection(Box::new(event)));
    }

    pub(super) fn add_attitudes(&mut self) {
        let run = self.session.run();
        let flying = run.attitudes().filter(|(_, attitude)| attitude.thrust > 0.0);
        let robots = flying.map(|(robot, Attitude { roll_rad, pitch_rad, thrust })| {
            let tenths = |degrees: f32| (f64::from(degrees) * 10.0).round() / 10.0;
            let [roll, pitch] = [roll_rad, pitch_rad].map(|angle| tenths(angle.to_degrees()));
            AttitudeDescription { robot, roll, pitch, thrust: f64::from((thrust * 100.0).round()) }
        });
        let attitudes = AttitudesEvent { robots: robots.collect() };
        if self.attitudes != attitudes {
            self.events.push(PageEvent::Attitudes(attitudes.clone()));
            self.attitudes = attitudes;
        }
    }
}

/// Returns the place of a pose in mm.
fn place(pose: Pose) -> [f64; 3] {
    [pose.x, pose.y, pose.z].map(f64::from)
}
