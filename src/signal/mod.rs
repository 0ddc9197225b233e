//! Room 2: mathematics on planes. No textures, no policy.

pub mod autocorrelation;
pub mod basis;
pub mod histogram;
pub mod localhist;
pub mod lowpass;
pub mod measure;
pub mod normal;
pub mod power;
pub mod resample;
pub mod self_difference;
pub mod steerable;
pub mod symmetric;
pub mod wavelet_noise;
pub mod window;
