//! `bbz import`: the scenario of an experiment of ARGoS. The expected places were computed by hand
//! from the meaning that ARGoS's own documentation gives to its attributes.

mod mistakes;
mod omissions;
mod places;

use crate::support::{Folder, Outcome, page};

const GUIDE: &str = include_str!("../../docs/argos.md");

/// A robot that stands for the foot-bot, so that expectations do not depend on the shipped one.
const ROVER: &str = "\
name = \"rover\"

[body]
drive = \"differential\"
radius_mm = 85
wheel_distance_mm = 140
speed_mm_s = 300

[[sensor]]
name = \"rab\"
kind = \"range-and-bearing\"
range_mm = 3000
";

const ROBOT: &str = "foot-bot=rover.toml";

/// An experiment whose robots run `walk.bzz`, with these entities in an arena of 4 m by 2 m.
fn experiment(entities: &str) -> String {
    format!(
        "<?xml version=\"1.0\" ?>
<!-- a comment before the root -->
<argos-configuration>
  <framework>
    <system threads=\"0\" />
    <experiment length=\"30\" ticks_per_second=\"10\" random_seed=\"7\" />
  </framework>
  <controllers>
    <buzz_controller_footbot id=\"walk\">
      <sensors><range_and_bearing implementation=\"medium\" medium=\"rab\" /></sensors>
      <params bytecode_file=\"build/walk.bo\" debug_file=\"build/walk.bdb\" />
    </buzz_controller_footbot>
  </controllers>
  <arena size=\"4, 2, 1\" center=\"0,0,0.5\">
{entities}
  </arena>
  <media><range_and_bearing id=\"rab\" check_occlusions=\"false\" /></media>
</argos-configuration>
"
    )
}

/// A foot-bot at a position.
fn foot_bot(id: &str, position: &str) -> String {
    format!(
        "<foot-bot id=\"{id}\"><body position=\"{position}\" /><controller config=\"walk\" /></foot-bot>"
    )
}

/// A folder with a script, a robot and an experiment with these entities.
fn folder(name: &str, entities: &str) -> Folder {
    let folder = Folder::with(name, "walk.bzz", "function step() { log(id) }\n");
    folder.write("rover.toml", ROVER);
    folder.write("field.argos", experiment(entities));
    folder
}

fn import(folder: &Folder) -> Outcome {
    folder.bbz(&["import", "field.argos", "--robot", ROBOT])
}

/// Returns the sections of the scenario after its comments and `[world]`.
#[track_caller]
fn robots(outcome: &Outcome) -> String {
    assert_eq!(outcome.status, Some(0), "{}", outcome.stderr);
    let (_, robots) = outcome.stdout.split_once("\nseed = 7\n").unwrap();
    robots.trim_start().to_owned()
}

#[test]
fn the_guide_can_be_carried_out() {
    let commands = page::carry_out(&Folder::new("import_guide"), GUIDE);
    assert_eq!(commands, 2);
}
