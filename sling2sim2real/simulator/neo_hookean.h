// The law `neo_hookean`: material.h alone. What every law gives beside material.h:

// how much steeper its nominal stress is at a predicted stretch than the neo-Hookean: damping follows the rate of the stress
auto steeper = [&](const real*) -> real { return one; };
// what it adds on edge i to the stress of a stretch g, and to its derivative
auto add_law = [&](int, const real (&)[3], real (&)[3], real (&)[3][3]) {};
// what an edge remembers: at the first step; as a step begins, and as it ends
auto begin_memory = [&]() {};
auto recall = [&](const scalar*, bool) {};
auto remember = [&](const scalar*, bool) {};
