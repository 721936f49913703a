//! The list of the models of robots: those that scenarios can have.
//!
//! The simulator knows no robot; programs hand it this list. A robot of your own with code of its own for the simulator is a crate
//! with a [`RobotModel`], and a line here.

use std::sync::Arc;

use bittybuzz_arena::robot::RobotModel;
use bittybuzz_crazyflie_model::CrazyflieModel;
use bittybuzz_kilobot_model::KilobotModel;
use bittybuzz_zooids_model::ZooidModel;

/// Returns every model, with the numbers of the real robots.
#[must_use]
pub fn all() -> Vec<Arc<dyn RobotModel>> {
    vec![
        Arc::new(KilobotModel::STANDARD),
        Arc::new(ZooidModel::STANDARD),
        Arc::new(CrazyflieModel::STANDARD),
    ]
}
