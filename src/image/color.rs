//! sRGB, linear light and CIE L*a*b* (D65).
