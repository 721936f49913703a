//! Geometric tracking control on SE(3) with feed-forward.
