use super::*;

#[test]
fn shipped_robots_are_named_as_their_files() {
    for ((name, _), robot) in shipped().iter().zip(all_shipped()) {
        assert_eq!(*name, robot.name);
    }
}
