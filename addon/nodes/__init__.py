"""Node trees for Cycles: the formulas as nodes, and the materials made of them."""
