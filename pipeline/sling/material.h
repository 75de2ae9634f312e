// The material: stable neo-Hookean without its logarithm (Smith, de Goes, Kim 2018), damped.
//
// With the deformation gradient F = [x0 x1 x2] (columns), J = det F, the energy a unit of volume is
//
//   W = mu/2 (|F|^2 - 3) - mu (J - 1) + lam/2 (J - 1)^2
//
// and the nominal stress mu F + p cof F, p = lam (J - 1) - mu. Viscous stress is d times the rate of the elastic
// stress: the tangent of W at the predicted state, applied to the rates F'. Its shape part is scaled by s, the
// volume part K J'^2 (K = lam - mu/3) is not. p in it is bounded so that every state dissipates: with a bound m on
// the largest principal stretch (the root of the largest row sum of |xk.xl|, exact where nothing shears)
//
//   -mu/m (1 + min(max(J, 0), 1)^2)/2  <=  p  <=  0.7 mu/m
//
//   D = d/2 [ K J'^2 + s ( mu |F'|^2 + p d2J(F', F') + mu/3 J'^2 ) ]

// F now, predicted, and its rate -> stress (columns) and its derivative, K[k (k + 1) / 2 + l] for columns k >= l,
// exact as long as p / mu is between `least` and `most`; `shaped` scales s further
auto material = [&](const real (&x)[3][3], const real (&xp)[3][3], const real (&xt)[3][3], SC least, SC most, real shaped, real (&stress)[3][3], real (&K)[6][3][3]) {
  real C[3][3], Cp[3][3], square = zero;  // cofactors; m squared
  UNROLL for (int k = 0; k < 3; ++k) {
    cross(x[(k + 1) % 3], x[(k + 2) % 3], C[k]); cross(xp[(k + 1) % 3], xp[(k + 2) % 3], Cp[k]);
    const real shear = magnitude(dot(xp[k], xp[(k + 1) % 3])) + magnitude(dot(xp[k], xp[(k + 2) % 3]));
    square = maximum(square, dot(xp[k], xp[k]) + shear);
  }
  const real J = dot(x[0], C[0]), Jp = dot(xp[0], Cp[0]);
  const real p = lam * (J - (SC)1) - mu;
  // far from rest Newton's method takes a smaller part of what may be negative
  const real pc = minimum(maximum(p, least * mu), most * mu);
  inexact = pc == p ? inexact : one;
  const real bound = mu / SQRT(maximum(square, zero + (SC)1e-6));
  const real kept = minimum(maximum(Jp, zero), one);
  const real pv = minimum(maximum(lam * (Jp - (SC)1) - mu, (SC)-0.5 * bound * (one + kept * kept)), (SC)0.7 * bound);
  const real Jt = dot(Cp[0], xt[0]) + dot(Cp[1], xt[1]) + dot(Cp[2], xt[2]);
  const real sv = s * shaped, dshv = dsh * shaped, volumetric = bulk + sv * mu / (SC)3;
  UNROLL for (int k = 0; k < 3; ++k) {
    const int k1 = (k + 1) % 3, k2 = (k + 2) % 3;
    real u[3], v[3];  // d2J applied to the rates
    cross(xt[k1], xp[k2], u); cross(xp[k1], xt[k2], v);
    UNROLL for (int c = 0; c < 3; ++c)
      stress[k][c] = mu * x[k][c] + p * C[k][c]
                   + d * (volumetric * Jt * Cp[k][c] + sv * (mu * xt[k][c] + pv * (u[c] + v[c])));
  }
  if (!fresh) return;
  UNROLL for (int k = 0; k < 3; ++k) UNROLL for (int l = 0; l <= k; ++l) {
    real (&block)[3][3] = K[k * (k + 1) / 2 + l];
    UNROLL for (int m = 0; m < 3; ++m) UNROLL for (int n = 0; n < 3; ++n)
      block[m][n] = lam * C[k][m] * C[l][n] + dh * volumetric * Cp[k][m] * Cp[l][n];
    if (k == l) {
      UNROLL for (int m = 0; m < 3; ++m) block[m][m] += mu + dshv * mu;
    } else {
      const int o = 3 - k - l;                                  // the third column
      const real sign = (l + 1) % 3 == k ? one : -one;          // by the order of the columns
      real z[3];
      UNROLL for (int c = 0; c < 3; ++c) z[c] = sign * (pc * x[o][c] + dshv * pv * xp[o][c]);
      block[0][1] -= z[2]; block[0][2] += z[1]; block[1][0] += z[2]; block[1][2] -= z[0]; block[2][0] -= z[1]; block[2][1] += z[0];
    }
  }
};
