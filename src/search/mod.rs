//! Room 3: who looks like whom.

pub mod atlas;
pub mod cut;
pub mod field;
pub mod patch;
pub mod patchmatch;
pub mod phase;
pub mod place_cost;
pub mod rarity;
pub mod seams;
pub mod source;
pub mod vote;
