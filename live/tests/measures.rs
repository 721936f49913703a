//! Measures, which come to the client as they become known.

use bittybuzz_live::{Live, Source};
use serde_json::{Value, json};

use crate::live::{SCENARIO, live_of};
use crate::{go_to, taken};

/// A time is known when its condition is true, a number at its time, and one of the end at the end.
#[test]
fn measures_come_when_they_are_known() {
    let measures = "[[measure]]\nname = \"first\"\nvalue = \"max(global.n)\"\nabove = 7\n\
        [[measure]]\nname = \"never\"\nvalue = \"max(global.n)\"\nabove = 1000\n\
        [[measure]]\nname = \"then\"\nvalue = \"max(global.n)\"\nat = 2\n\
        [[measure]]\nname = \"last\"\nvalue = \"max(global.n)\"\nabove = 50\nat = \"end\"\n";
    let mut live = live_of(&format!("{SCENARIO}{measures}"));
    let of = |live: &mut Live| -> Option<Value> {
        let all = taken(live);
        all.into_iter().rfind(|one| one["event"] == "measures").map(|one| one["values"].clone())
    };
    live.begin();
    let all = taken(&mut live);
    let first =
        json!({ "name": "first", "text": "first time of max(global.n) above 7", "is_time": true });
    assert_eq!((&all[0]["event"], &all[0]["measures"][0]), (&json!("begin"), &first));
    assert_eq!(all[0]["measures"][3]["is_time"], json!(false));
    go_to(&mut live, 7);
    assert_eq!(of(&mut live), None);
    go_to(&mut live, 20);
    let known = of(&mut live).unwrap();
    let time = known[0].as_f64().unwrap();
    assert!((0.8..=1.0).contains(&time), "{known}");
    assert_eq!(known, json!([time, null, 19.0, null]));
    go_to(&mut live, 100);
    assert_eq!(of(&mut live), Some(json!([time, null, 19.0, 1.0])));
    // A way back forgets those of later.
    go_to(&mut live, 7);
    assert_eq!(of(&mut live), Some(json!([null, null, null, null])));
}
