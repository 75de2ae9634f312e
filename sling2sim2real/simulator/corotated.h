// What the law `corotated` adds along an edge to the neo-Hookean material: PhysX's, as its public source has it (softBodyGM.cu
// of PhysX 5.6, tetrahedronsSolveGM, eCO_ROTATIONAL), whose energy is mu |F - R|^2 + lam/2 (J - 1)^2 with the rotation R in F.
//
// Of an incompressible edge at stretch l = |g|, pulled along, that law's nominal stress is
//
//   p(l) = 2 mu (l - 1 - l^-2 + l^-3/2)
//
// of which material.h gives mu (l - l^-2) and `extra` the rest. What that rest is depends on Poisson's ratio so little that
// from 0.3 to 0.49 a string that is free across pulls within 1 % of PhysX's law up to a stretch of 4. Below l = 0.7 p goes on
// straight. It grows with l everywhere. Across, in shear and in bending the material stays neo-Hookean.

// at a stretch: what is added to the stress, and its slope
auto added = [&](real at, real &extra, real &extra_slope) {
  const real i = one / at, i2 = i * i, half = SQRT(i);
  extra = mu * (at - (scalar)2 - i2 + (scalar)2 * i * half);
  extra_slope = mu * (one + (scalar)2 * i2 * i - (scalar)3 * i2 * half);
};
// how much steeper p is than the neo-Hookean: damping follows the rate of the stress
auto steeper = [&](const real* predicted) -> real {
  const real at = maximum(SQRT(dot(predicted, predicted)), zero + (scalar)0.7), i = one / at;
  real extra, extra_slope;
  added(at, extra, extra_slope);
  return one + extra_slope / (mu * (one + (scalar)2 * i * i * i));
};
// to the stress of a stretch g and its derivative
auto add_law = [&](int, const real (&g)[3], real (&stress)[3], real (&K)[3][3]) {
  const real l = SQRT(dot(g, g) + (scalar)1e-12), at = maximum(l, zero + (scalar)0.7);
  real extra, extra_slope;
  added(at, extra, extra_slope);
  const real across = (extra + extra_slope * (l - at)) / l, along = (extra_slope - across) / (l * l);
  UNROLL for (int m = 0; m < 3; ++m) {
    stress[m] += across * g[m];
    if (fresh) UNROLL for (int n = 0; n < 3; ++n) K[m][n] += along * g[m] * g[n] + (m == n ? across : zero);
  }
};
auto begin_memory = [&]() {};
auto recall = [&](const scalar*, bool) {};
auto remember = [&](const scalar*, bool) {};
