use super::*;
use crate::frame::edges;
use crate::plan::samples;
