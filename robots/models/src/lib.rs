//! The list of the simulator's robot models, for use in scenarios.
//!
//! The simulator knows no robot; programs pass this list to it. To add a robot with its own code in
//! the simulator, write a crate with a [`RobotModel`] and add a line here.

use std::sync::Arc;

use bittybuzz_arena::robot::RobotModel;
use bittybuzz_crazyflie_model::CrazyflieModel;
use bittybuzz_kilobot_model::KilobotModel;
use bittybuzz_zooids_model::ZooidModel;

/// Returns all models, with the parameters of the real robots.
#[must_use]
pub fn all() -> Vec<Arc<dyn RobotModel>> {
    vec![
        Arc::new(KilobotModel::STANDARD),
        Arc::new(ZooidModel::STANDARD),
        Arc::new(CrazyflieModel::STANDARD),
    ]
}
