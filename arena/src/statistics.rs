//! Statistics of runs and of robots: quantiles, and times that not every run reaches.

/// Returns a quantile of sorted numbers, of which a share is below it: 0.5 is the median. A quantile
/// between two numbers lies on the line between them: definition 7 of Hyndman and Fan (1996), the
/// default of NumPy and R. Returns `None` without numbers. `share` is 0 to 1.
pub fn quantile(sorted: &[f64], share: f64) -> Option<f64> {
    let last = sorted.len().checked_sub(1)?;
    let place = share * last as f64;
    let (below, above) = (sorted[place.floor() as usize], sorted[place.ceil() as usize]);
    // Infinite neighbors that are equal have no difference.
    if below == above {
        return Some(below);
    }
    Some(below + (above - below) * place.fract())
}

/// Returns the smallest, lower quartile, median, upper quartile and largest of some numbers
/// ([`quantile`]). NaN is no number. Returns `None` without numbers.
pub fn quartiles(numbers: &[f64]) -> Option<[f64; 5]> {
    let mut sorted: Vec<f64> = numbers.iter().copied().filter(|number| !number.is_nan()).collect();
    sorted.sort_by(f64::total_cmp);
    quantile(&sorted, 0.0)?;
    Some([0.0, 0.25, 0.5, 0.75, 1.0].map(|share| quantile(&sorted, share).unwrap_or(f64::NAN)))
}

/// An observation of a time to an event: the time of the event, or the end of an observation in
/// which it did not come.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EventTime {
    /// The time of the event or of the end, in any unit.
    pub time: f64,
    /// True if the event came; false if the observation ended before it (a censored time).
    pub is_reached: bool,
}

/// Shares that differ by no more than this are equal. Products of up to ten million factors are
/// more exact than this, and shares of up to ten million observations are further apart.
const SHARE_TOLERANCE: f64 = 1e-8;

/// Returns the time at which the share of observations without the event falls to `share` or
/// below, by the estimator of Kaplan and Meier (1958): 0.5 gives the median. An observation that
/// ends at the time of an event counts as being at risk then. Returns `None` if the share stays
/// above, as it does for the median if fewer than half of the observations reach the event and all
/// others are as long.
pub fn kaplan_meier(observations: &[EventTime], share: f64) -> Option<f64> {
    let mut sorted = observations.to_vec();
    sorted.sort_by(|one, other| one.time.total_cmp(&other.time));
    let mut survivors = 1.0;
    let mut rest = sorted.as_slice();
    while let Some(first) = rest.first() {
        let at_risk = rest.len() as f64;
        let count = rest.iter().take_while(|other| other.time == first.time).count();
        let (now, later) = rest.split_at(count.max(1));
        let events = now.iter().filter(|observation| observation.is_reached).count() as f64;
        survivors *= 1.0 - events / at_risk;
        if events > 0.0 && survivors <= share + SHARE_TOLERANCE {
            return Some(first.time);
        }
        rest = later;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn observations(text: &str) -> Vec<EventTime> {
        let observation = |word: &str| EventTime {
            time: word.trim_end_matches('+').parse().unwrap(),
            is_reached: !word.ends_with('+'),
        };
        text.split(' ').map(observation).collect()
    }

    /// Weeks of remission of leukemia, `+` for patients who were still in remission (Freireich et
    /// al., Blood 21:699, 1963; printed in Kalbfleisch and Prentice, The Statistical Analysis of
    /// Failure Time Data, and as `gehan` in the R package MASS). The published medians are 23 weeks
    /// with 6-mercaptopurine and 8 weeks with a placebo.
    #[test]
    fn medians_are_those_that_are_published_for_a_trial() {
        let treated = "6 6 6 6+ 7 9+ 10 10+ 11+ 13 16 17+ 19+ 20+ 22 23 25+ 32+ 32+ 34+ 35+";
        let placebo = "1 1 2 2 3 4 4 5 5 8 8 8 8 11 11 12 12 15 17 22 23";
        assert_eq!(kaplan_meier(&observations(treated), 0.5), Some(23.0));
        assert_eq!(kaplan_meier(&observations(placebo), 0.5), Some(8.0));
        // The published estimate with 6-mercaptopurine is .857 from week 6, .807 from week 7, .753
        // from week 10, .690 from 13, .627 from 16, .538 from 22 and .448 from 23 on.
        for (share, week) in
            [(0.858, 6.0), (0.856, 7.0), (0.806, 10.0), (0.691, 13.0), (0.628, 16.0), (0.538, 22.0)]
        {
            assert_eq!(kaplan_meier(&observations(treated), share), Some(week), "{share}");
        }
        assert_eq!(kaplan_meier(&observations(treated), 0.44), None);
    }

    #[test]
    fn fewer_than_half_have_no_median() {
        let of = |reached: usize, all: usize| {
            let observation =
                |number: usize| EventTime { time: (number + 1) as f64, is_reached: true };
            let mut times: Vec<EventTime> = (0..reached).map(observation).collect();
            times.resize(all, EventTime { time: 1e6, is_reached: false });
            kaplan_meier(&times, 0.5)
        };
        assert_eq!(of(14, 30), None);
        assert_eq!(of(15, 30), Some(15.0));
        assert_eq!(of(30, 30), Some(15.0));
        assert_eq!(of(0, 30), None);
        assert_eq!(of(0, 0), None);
        // Rounding of a long product does not decide.
        assert_eq!(of(50_000, 100_000), Some(50_000.0));
        assert_eq!(of(49_999, 100_000), None);
    }

    #[test]
    fn quantiles_are_those_of_numpy() {
        // numpy.quantile([1, 2, 4, 8], q), with the default method "linear".
        let sorted = [1.0, 2.0, 4.0, 8.0];
        for (share, value) in
            [(0.0, 1.0), (0.1, 1.3), (0.25, 1.75), (0.5, 3.0), (0.75, 5.0), (0.9, 6.8), (1.0, 8.0)]
        {
            let found = quantile(&sorted, share).unwrap();
            assert!((found - value).abs() < 1e-12, "{share}: {found}, not {value}");
        }
        assert_eq!(quantile(&[], 0.5), None);
        assert_eq!(quantile(&[7.0], 0.9), Some(7.0));
        assert_eq!(quantile(&[f64::INFINITY; 2], 0.5), Some(f64::INFINITY));
        assert_eq!(quartiles(&[8.0, f64::NAN, 1.0, 4.0, 2.0]), Some([1.0, 1.75, 3.0, 5.0, 8.0]));
        assert_eq!(quartiles(&[7.0, 1.0, 3.0, 5.0]), Some([1.0, 2.5, 4.0, 5.5, 7.0]));
        assert_eq!(quartiles(&[2.0]), Some([2.0; 5]));
        assert_eq!(quartiles(&[f64::NAN]), None);
        assert_eq!(quartiles(&[]), None);
    }
}
