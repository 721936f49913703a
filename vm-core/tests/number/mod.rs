pub mod binary32;
pub mod float16_model;
pub mod random;
