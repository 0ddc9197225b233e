//! Baseline "make seamless", as image editors do it.
