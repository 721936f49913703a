//! Operations on robots that are controlled from outside of the engine. Firmware in an emulator may
//! turn the wheels at any time.

use super::brain::Brain;
use super::error::UnknownRobot;
use super::geometry::Pose;
use super::herd::Cohort;
use super::id::RobotId;
use super::light::{self, Lighting};
use super::ranger::Sight;
use super::ray::Side;
use super::world::World;

impl<B: Brain> World<B> {
    /// Returns the number of equal substeps of a tick. A substep is short enough that no robot
    /// passes through another one.
    #[must_use]
    pub fn substeps(&self) -> u32 {
        self.substeps
    }

    /// Runs the left and right wheels or vibration motors of a robot with these duties in percent
    /// for a time in seconds. Contacts are not resolved yet. Returns the speed at the end, in mm/s
    /// ahead and radians per second anticlockwise, even if the time is 0. A body that stops at once
    /// returns zeros, a body without such motors `None`.
    pub fn roll(
        &mut self,
        id: RobotId,
        duties: [f32; 2],
        seconds: f32,
    ) -> Result<Option<[f32; 2]>, UnknownRobot> {
        let index = self.index(id)?;
        let Cohort { first, block, .. } = &mut self.cohorts[self.robots[index].cohort as usize];
        Ok(block.roll(index - *first, duties, &mut self.poses[index], seconds))
    }

    /// Returns the reading of a robot's light sensor, 0 to 1023.
    pub fn light(&self, id: RobotId) -> Result<u16, UnknownRobot> {
        let index = self.index(id)?;
        let pose = &self.poses[index];
        let (ambient, shadows) = (self.settings.ambient_light, self.shadows());
        let height_mm = pose.z + self.herd_of(index).shape.height_mm;
        Ok(light::reading(pose, height_mm, Lighting { ambient, lamps: &self.lights, shadows }))
    }

    /// Returns the distances in mm from a robot's middle to the nearest obstacle of its Multi-ranger
    /// deck to the front, left, back and right; `None` without one in reach.
    pub fn ranges(&self, id: RobotId) -> Result<[Option<f32>; 4], UnknownRobot> {
        let index = self.index(id)?;
        let World { settings, obstacles, crowd, poses, .. } = self;
        let sight = Sight { area: settings.area, obstacles, crowd };
        let sides = [Side::Front, Side::Left, Side::Back, Side::Right];
        Ok(sides.map(|side| sight.range(id, &poses[index], side)))
    }

    /// Sets the position in mm that a robot reports as its own. Its direction is that of its body.
    pub fn set_estimate(&mut self, id: RobotId, [x, y, z]: [f32; 3]) -> Result<(), UnknownRobot> {
        let index = self.index(id)?;
        let heading = self.poses[index].heading;
        self.estimates[index] = Some(Pose { x, y, z, heading });
        Ok(())
    }

    /// Makes the oscillator of a robot fast by `error_ppm` millionths from now on; a negative number
    /// makes it slow.
    pub fn set_clock_error(&mut self, id: RobotId, error_ppm: i32) -> Result<(), UnknownRobot> {
        let index = self.index(id)?;
        let medium = self.herd_of(index).medium;
        self.robots[index].radio.set_clock_error(medium, error_ppm);
        Ok(())
    }

    /// Sets the LED of a robot: the sum of 1 red, 2 green, 4 blue.
    pub fn shine(&mut self, id: RobotId, led: u8) -> Result<(), UnknownRobot> {
        let index = self.index(id)?;
        self.robots[index].led = led & 7;
        Ok(())
    }
}
