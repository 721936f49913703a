//! The pattern in which a LED shows a number: that number of blinks, then a pause.

use embassy_time::Duration;

use crate::liveness::BEAT;

/// The length of a phase of the pattern.
pub const PHASE: Duration = BEAT;

/// Phases in which the LED is lit (200 ms), and phases from one blink to the next (400 ms).
const LIT: u32 = 4;
const BLINK: u32 = 8;
/// Phases that follow the last blink's cycle before the pattern repeats. With the dark end of that
/// cycle, the LED is dark for 1.4 s.
const PAUSE: u32 = 24;

/// Returns true if the LED that blinks `number` is lit in phase `phase`.
pub const fn is_lit(number: u8, phase: u32) -> bool {
    let blinks = BLINK * number as u32;
    let at = phase % (blinks + PAUSE);
    at < blinks && at % BLINK < LIT
}

#[cfg(test)]
mod tests {
    use super::is_lit;

    #[test]
    fn as_many_blinks_as_the_number_says() {
        for number in 0..=17_u8 {
            let round = 8 * u32::from(number) + 24;
            let goes_on =
                |phase: u32| is_lit(number, phase) && (phase == 0 || !is_lit(number, phase - 1));
            assert_eq!((0..round).filter(|phase| goes_on(*phase)).count(), number.into());
            assert_eq!(
                (round..3 * round).filter(|phase| goes_on(*phase)).count(),
                2 * usize::from(number)
            );
            // The LED is dark for more than a second before the pattern repeats, longer than
            // between two blinks.
            assert!((round - 24..round).all(|phase| !is_lit(number, phase)));
        }
    }
}
