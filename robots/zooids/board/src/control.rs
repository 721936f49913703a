//! The commands that a Zooid handles, and its counters in the protocol's messages.

use bittybuzz_chips::{ChipProperties, ResetCause};
use bittybuzz_emulation::message::{self, BoardStatistics, Command};
use bittybuzz_emulation::{CommandRefusal, Control, finite, lsi, probability};

use crate::{LightDisturbance, TablePose, ZooidBoard, ZooidStatistics};

impl Control for ZooidBoard {
    const NAME: &'static str = "Zooid";

    fn execute(&mut self, command: Command) -> Result<(), CommandRefusal> {
        match command {
            Command::Place { x_mm, y_mm, heading_degrees, vx_mm_s, vy_mm_s, turn_degrees_s } => {
                self.place(Some(TablePose {
                    x_mm: finite("x_mm", x_mm)?,
                    y_mm: finite("y_mm", y_mm)?,
                    heading_degrees: finite("heading_degrees", heading_degrees)?,
                    velocity_mm_s: [finite("vx_mm_s", vx_mm_s)?, finite("vy_mm_s", vy_mm_s)?],
                    turn_degrees_s: finite("turn_degrees_s", turn_degrees_s)?,
                }));
            }
            Command::Remove => self.place(None),
            Command::Light { lose, jitter_us, glitches_per_s, seed } => {
                let lose = probability(lose)?;
                if !(0.0..=LightDisturbance::JITTER_US_MAX).contains(&jitter_us) {
                    let most = LightDisturbance::JITTER_US_MAX;
                    return Err(CommandRefusal::Jitter { most, value: jitter_us });
                }
                if !(0.0..=LightDisturbance::GLITCHES_PER_S_MAX).contains(&glitches_per_s) {
                    let most = LightDisturbance::GLITCHES_PER_S_MAX;
                    return Err(CommandRefusal::Glitches { most, value: glitches_per_s });
                }
                self.set_light(LightDisturbance { lose, jitter_us, glitches_per_s, seed });
            }
            Command::PowerDetector { reading } => self.set_power_detector(reading.into()),
            Command::Touch { keys } => self.press(keys),
            Command::Chip { lsi_hz, crystal, memory, seed, debugger: false } => {
                let (lsi_hz, memory) =
                    (lsi(30_000..=50_000, lsi_hz)?, bittybuzz_emulation::memory(memory, seed));
                self.set_chip(ChipProperties {
                    lsi_hz,
                    has_crystal: crystal,
                    memory,
                    is_debugged: false,
                });
            }
            // A power-on is requested with the command `power` instead.
            Command::Reset { cause: message::ResetCause::BrownOut } => {
                self.request_reset(ResetCause::BrownOut);
            }
            Command::Power { on } => self.set_power(on),
            // The model of the air handles this command; the board has nothing to do.
            Command::Deaf { .. } => {}
            Command::Battery { volts, charging, .. } => {
                self.set_battery(f64::from(volts), charging);
            }
            _ => return Err(CommandRefusal::OtherRobot(Self::NAME)),
        }
        Ok(())
    }

    fn counted(&self) -> BoardStatistics {
        BoardStatistics::Zooid(self.statistics().into())
    }
}

impl From<ZooidStatistics> for message::ZooidStatistics {
    fn from(s: ZooidStatistics) -> Self {
        message::ZooidStatistics {
            radio_sent: s.radio.sent,
            radio_received: s.radio.received,
            radio_damaged: s.radio.damaged,
            radio_unheard: s.radio.unheard,
            radio_overflown: s.radio.overflown,
            radio_too_early: s.radio.too_early,
            radio_written_while_active: s.radio.written_while_active,
            radio_short_pulses: s.radio.short_pulses,
            touch_addressed: s.touch_addressed,
            motion_addressed: s.motion_addressed,
            brightest: s.brightest,
            clocks_hz: s.clocks_hz,
            accesses_without_clock: s.accesses_without_clock,
            unknown: s.unknown,
        }
    }
}

#[cfg(test)]
mod tests {
    use bittybuzz_chips::Board;

    use super::*;

    fn refusal(line: &str) -> String {
        let command = message::parse(line.as_bytes()).expect("a command");
        match ZooidBoard::power_on(0).execute(command) {
            Ok(()) => "obeyed".into(),
            Err(refusal) => refusal.to_string(),
        }
    }

    #[test]
    fn a_zooid_executes_its_commands_and_refuses_others() {
        for (line, answer) in [
            (r#"{"command":"place","x_mm":1,"y_mm":2,"heading_degrees":-3.5}"#, "obeyed"),
            (r#"{"command":"place","x_mm":1e300,"y_mm":2,"heading_degrees":0}"#, "obeyed"),
            (r#"{"command":"remove"}"#, "obeyed"),
            (r#"{"command":"touch","keys":255}"#, "obeyed"),
            (r#"{"command":"power","on":false}"#, "obeyed"),
            (r#"{"command":"deaf","to":[3,1]}"#, "obeyed"),
            (r#"{"command":"light","lose":1,"jitter_us":300,"seed":0}"#, "obeyed"),
            (
                r#"{"command":"light","lose":-0.1,"jitter_us":0,"seed":0}"#,
                "between 0 and 1, not -0.1",
            ),
            (
                r#"{"command":"light","lose":0,"jitter_us":0,"glitches_per_s":10000,"seed":0}"#,
                "obeyed",
            ),
            (
                r#"{"command":"light","lose":0,"jitter_us":0,"glitches_per_s":-1,"seed":0}"#,
                "between 0 and 10000, not -1",
            ),
            (
                r#"{"command":"light","lose":0,"jitter_us":301,"seed":0}"#,
                "between 0 and 300, not 301",
            ),
            (
                r#"{"command":"light","lose":0,"jitter_us":-1,"seed":0}"#,
                "between 0 and 300, not -1",
            ),
            (r#"{"command":"power_detector","reading":"live"}"#, "obeyed"),
            (r#"{"command":"chip","lsi_hz":50000,"crystal":false}"#, "obeyed"),
            (r#"{"command":"chip","lsi_hz":29999}"#, "between 30000 and 50000, not 29999"),
            (r#"{"command":"chip","lsi_hz":40000,"memory":"noise","seed":3}"#, "obeyed"),
            (r#"{"command":"chip","debugger":true}"#, "does not handle this command"),
            (r#"{"command":"reset","cause":"brown_out"}"#, "obeyed"),
            (r#"{"command":"reset","cause":"pin"}"#, "a Zooid does not handle this command"),
            (r#"{"command":"shutdown"}"#, "a Zooid does not handle this command"),
            (r#"{"command":"send","type":1,"payload":""}"#, "a Zooid does not handle this command"),
        ] {
            let answered = refusal(line);
            assert!(answered.contains(answer), "{line}: {answered}");
        }
    }
}
