//! Motors that steer between commands.

use std::future::Future;
use std::pin::pin;
use std::task::{Context, Poll, Waker};

use crate::common::{advance_us, clock, note, now_ms, take_events};
use bittybuzz_runtime::liveness::Liveness;
use bittybuzz_runtime::setpoint::{Channel, HOLD, MotorDriver, SetpointWriter, drive};
use bittybuzz_runtime::tasks;
use embassy_time::{Duration, Timer};

/// Fake motors that record their actions and steer every 20 ms.
#[derive(Default)]
struct Steered {
    goal: Option<i32>,
}

impl MotorDriver for Steered {
    type Setpoint = i32;

    fn apply(&mut self, goal: i32) {
        self.goal = Some(goal);
        note(format!("to {goal}"));
    }

    fn stop(&mut self) {
        self.goal = None;
        note("stop");
    }

    async fn steer(&mut self) {
        Timer::after(Duration::from_millis(20)).await;
        if let Some(goal) = self.goal {
            note(format!("on to {goal}"));
        }
    }
}

tasks! {
    enum Task { Motors }
}

/// The motors steer until the set-point expires, half a second after it was renewed, and no command
/// is late because of that.
#[test]
fn a_goal_is_steered_to_until_it_expires() {
    let _turn = clock();
    take_events();
    static CHANNEL: Channel<i32> = Channel::new();
    let liveness: &'static Liveness<Task> = Box::leak(Box::new(Liveness::new()));
    let mut motors = Steered::default();
    let mut task = pin!(drive(&CHANNEL, &mut motors, liveness.pulse(Task::Motors)));
    let mut context = Context::from_waker(Waker::noop());
    let mut writer = SetpointWriter::new(&CHANNEL);
    let mut alive_at = 0;
    while now_ms() < 1000 {
        match now_ms() {
            0 | 95 => writer.renew(),
            90 => writer.set(5),
            105 => writer.set(7),
            _ => {}
        }
        assert_eq!(task.as_mut().poll(&mut context), Poll::Pending);
        if liveness.all_live() {
            alive_at = now_ms();
        }
        assert!(now_ms() - alive_at <= 60, "no sign of life");
        advance_us(1000);
    }
    let events = take_events();
    let of = |wanted: &str| -> Vec<u64> {
        events.iter().filter(|(_, text)| text == wanted).map(|(at, _)| *at).collect()
    };
    assert_eq!(of("to 7"), [105]);
    let steered = of("on to 7");
    assert!(steered.len() >= 20 && steered.windows(2).all(|pair| pair[1] - pair[0] <= 25));
    let end = 95 + HOLD.as_millis();
    assert!(steered.iter().all(|at| *at < end + 2), "{steered:?}");
    let stopped = *of("stop").last().unwrap();
    assert!((end..end + 2).contains(&stopped), "{stopped}");
}
