"""The paper's method: extreme events of the signed strain rate, corrected and as printed."""
