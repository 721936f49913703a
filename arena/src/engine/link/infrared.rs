//! Infrared of the Kilobots: its parameters, and the experiments from which they come.
//!
//! The validation files of argos3-kilobot (Pinciroli et al., ANTS 2018, doi
//! 10.1007/978-3-030-00533-7_14; repository revision 381db2a) hold three series of a grid of 25
//! robots at 50 mm. They give the share of a sender's frames that arrived at each distance between
//! centers:
//!
//! | series | 50 mm | 71 | 100 | 112 | 141 | 158 | 180 | 200 | 250 |
//! |---|---|---|---|---|---|---|---|---|---|
//! | tau 0 | .971 | .965 | .960 | .958 | .954 | .946 | .932 | .51 | .16 |
//! | tau 0.25 | .956 | .932 | .919 | .899 | .78 | .14 | .02 | 0 | 0 |
//! | tau 0.5 | .959 | .940 | .931 | .914 | .79 | .15 | .02 | 0 | 0 |
//!
//! * **Loss.** 4.0 to 4.4 % are the only losses without a dependence on distance that lie between
//!   the least and the greatest of the three series at 50, 71 and at 100 mm. 4.2 % is their middle.
//!   The loss of each series grows slowly, from 3 or 4 % to 4 or 8 % at 100 mm; two values for
//!   `loss` can follow that.
//! * **Range.** The two series with the most runs (40 of 50) fall to a half of their level at 112
//!   mm between 141 and 158 mm: a logistic curve through both has its middle at 150 mm. That of tau
//!   0 is at 201 mm, through 180 and 200 mm. The makers state "up to 10 cm" (Rubenstein, Ahler,
//!   Nagpal, ICRA 2012) and no curve; range is a property of robots, table and light.
//! * **Edge.** The same curves fall from 90 to 10 % of their level within twice 10.7 mm and twice
//!   11 mm: 10 mm.

use super::{LinkSettings, Loss, Medium, UNIT_US};

/// The diameter of a Kilobot, between whose rims its range is measured, in mm.
const DIAMETER_MM: f32 = 33.0;

/// Infrared of the Kilobots: half-duplex, with carrier sense and back-off as in kilolib.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Infrared {
    pub link: LinkSettings,
    /// Shortest time between two frames of a robot in units of 128 µs: kilolib's `kilo_tx_period`.
    pub tx_period: u16,
    /// Standard deviation of the rates of the robots' oscillators, as a fraction of 1.
    pub clock_sigma: f32,
    /// Standard deviation of the measured distance, mm.
    pub distance_sigma: f32,
}

/// An experiment that measured how far infrared of Kilobots reaches.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InfraredPreset {
    /// The series tau 0.25 and tau 0.5 of the validation files: 150 mm between centers.
    Ants2018,
    /// The series tau 0 of these files: 201 mm between centers.
    Ants2018Long,
    /// The makers' figure: 100 mm between centers. Loss and edge are those of the files.
    Icra2012,
}

impl InfraredPreset {
    /// The words of scenarios.
    pub const WORDS: [(&str, Self); 3] = [
        ("ants2018", InfraredPreset::Ants2018),
        ("ants2018-long", InfraredPreset::Ants2018Long),
        ("icra2012", InfraredPreset::Icra2012),
    ];

    /// Returns the range, loss and edge of the experiment.
    #[must_use]
    pub const fn link(self) -> LinkSettings {
        let centers_mm = match self {
            InfraredPreset::Ants2018 => 150.0,
            InfraredPreset::Ants2018Long => 201.0,
            InfraredPreset::Icra2012 => 100.0,
        };
        LinkSettings {
            range: Some(centers_mm - DIAMETER_MM),
            edge: 10.0,
            loss: Loss { near: 0.042, far: 0.042 },
            duplicate: 0.0,
            reorder: 0.0,
        }
    }
}

impl Infrared {
    /// Range, loss and edge of the series with the most runs, because they are the only ones that
    /// were measured; two frames per second as in kilolib, and distances with a deviation of 2 mm
    /// (ICRA 2012). The deviation of the oscillators is a choice: the data sheet of the ATmega328P
    /// promises 1 % after calibration.
    pub const STANDARD: Self = Infrared {
        link: InfraredPreset::Ants2018.link(),
        tx_period: (Medium::Infrared.frame_period_us() / UNIT_US) as u16,
        clock_sigma: 0.005,
        distance_sigma: 2.0,
    };
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Least and greatest of the three series, at distances between centers in mm.
    const PUBLISHED: [(f32, f32, f32); 3] =
        [(50.0, 0.956, 0.971), (70.7, 0.932, 0.965), (100.0, 0.919, 0.960)];

    fn reception(preset: InfraredPreset, centers_mm: f32) -> f32 {
        let LinkSettings { range, edge, loss, .. } = preset.link();
        let middle_mm = range.unwrap() + DIAMETER_MM;
        // A logistic curve.
        let share = 1.0 / (1.0 + (9_f32.ln() * (centers_mm - middle_mm) / edge).exp());
        (1.0 - loss.near) * share
    }

    #[test]
    fn the_measured_presets_are_within_the_published_series() {
        for preset in [InfraredPreset::Ants2018, InfraredPreset::Ants2018Long] {
            for (centers_mm, least, most) in PUBLISHED {
                let found = reception(preset, centers_mm);
                assert!((least..=most).contains(&found), "{preset:?} at {centers_mm}: {found}");
            }
        }
    }

    /// The edges of the series: where the share has fallen by much.
    #[test]
    fn the_edges_are_those_of_the_series() {
        let series = [
            (InfraredPreset::Ants2018, [(141.4, 0.785), (158.1, 0.145), (180.3, 0.02)]),
            (InfraredPreset::Ants2018Long, [(158.1, 0.946), (180.3, 0.932), (200.0, 0.51)]),
        ];
        for (preset, shares) in series {
            for (centers_mm, share) in shares {
                let found = reception(preset, centers_mm);
                assert!((found - share).abs() < 0.06, "{preset:?} at {centers_mm}: {found}");
            }
        }
    }
}
