// Newton's system: the Hessian is block-tridiagonal, a block N x N a section. It is eliminated from the first section to
// the last (D = L diag L' of each block; Schur complement into the next) and substituted back.
//
// A thread has COLUMNS columns of a block: of D itself, of U, the transposed coupling with the next section, and of
// `next`, what goes into the next section's block. Column N of U and `next` is the residual.

real change = zero, imbalance = zero;         // longest entry of Newton's step [m]; largest residual [N]
real indefinite = zero, poison = zero;        // whether a pivot is not positive; no number as soon as anything is

// the residual of the sections from `first` on, a section a member, before elimination mixes it
auto weigh = [&](int first, real (&before)[N]) {
  const int i = first + member;
  if (i < L) UNROLL for (int m = 0; m < N; ++m) {
    const real f = RESIDUAL(m, member) + (member ? RESIDUAL_NEXT(m, member - 1) : before[m]);
    if (moves(i, m)) { imbalance = maximum(imbalance, magnitude(f) * (m < PLACES ? (SC)1 : per_edge)); poison += f * zero; }
  }
  UNROLL for (int m = 0; m < N; ++m) before[m] = RESIDUAL_NEXT(m, T - 1);
};

// my columns of section i, of which `next` has what the sections before left
auto take = [&](int i, real (&D)[COLUMNS][N], real (&U)[COLUMNS][N], real (&next)[COLUMNS][N]) {
  const bool special = i == 0 || i == MID - 1 || i == MID || i >= L - 2;  // some degrees of freedom there may have no equation
  UNROLL for (int q = 0; q < COLUMNS; ++q) {
    const int c = q + member;
    real carry[N];
    column(i % T, c, D[q], U[q], carry);
    if (c < N) { UNROLL for (int m = FIRST_ROW(c); m < N; ++m) D[q][m] += next[q][m]; }
    else { UNROLL for (int m = 0; m < N; ++m) U[q][m] += next[q][m]; }
    // opening pads hold the band back with what friction they have left
    if (i == MID && opening && c >= N) UNROLL for (int m = 0; m < PLACES; ++m) U[q][m] += share(m) * capacity * direction[m % 3];
    if (special) {
      const bool here = c >= N || moves(i, c), there = c >= N || (i < L - 1 && moves(i + 1, c));
      UNROLL for (int m = 0; m < N; ++m) {
        if (!moves(i, m) || !here) D[q][m] = m == c ? one : zero;
        if (!moves(i, m) || !there) U[q][m] = zero;
      }
    }
    UNROLL for (int m = 0; m < N; ++m) next[q][m] = carry[m];
  }
};

// LDL' of the block: D becomes the multipliers below its diagonal, `inverse` 1 / pivot; U is solved forwards with it.
// A team does both at once, pivot by pivot; a thread alone takes U column by column, which stay in its registers
auto factorise = [&](real (&D)[COLUMNS][N], real (&U)[COLUMNS][N], real (&inverse)[N], real (&own_inverse)[COLUMNS]) {
  UNROLL for (int k = 0; k < N; ++k) {
    const real pivot = OF(D, k, k);
    indefinite = pivot > zero ? indefinite : one;
    inverse[k] = one / pivot;
    real multiplier[N];
    UNROLL for (int m = k + 1; m < N; ++m) multiplier[m] = OF(D, k, m) * inverse[k];
#if COLUMNS == 1
    const real a = member > k ? D[0][k] : zero;
    UNROLL for (int m = k + 1; m < N; ++m) {
      D[0][m] = member == k ? multiplier[m] : D[0][m] - multiplier[m] * a;
      U[0][m] -= multiplier[m] * U[0][k];
    }
    own_inverse[0] = member == k || k == 0 ? inverse[k] : own_inverse[0];
#else
    UNROLL for (int c = k + 1; c < N; ++c) UNROLL for (int m = c; m < N; ++m) D[c][m] -= multiplier[m] * D[k][c];
    UNROLL for (int m = k + 1; m < N; ++m) D[k][m] = multiplier[m];
    own_inverse[k] = inverse[k];
#endif
  }
#if COLUMNS > 1
  UNROLL for (int q = 0; q < COLUMNS; ++q)
    UNROLL for (int k = 0; k < N; ++k) UNROLL for (int m = k + 1; m < N; ++m) U[q][m] -= D[k][m] * U[q][k];
#endif
};

// Schur complement into the next section; what the back substitution needs is kept
auto complement = [&](int i, real (&D)[COLUMNS][N], real (&U)[COLUMNS][N], real (&inverse)[N], real (&own_inverse)[COLUMNS],
                      real (&next)[COLUMNS][N]) {
  SHARE(U);
  UNROLL for (int q = 0; q < COLUMNS; ++q) {
    const int c = q + member;
    real scaled[N];
    UNROLL for (int k = 0; k < N; ++k) scaled[k] = U[q][k] * inverse[k];
    UNROLL for (int n = FIRST_ROW(c < N ? c : 0); n < N; ++n) {
      real sum = next[q][n];
      UNROLL for (int k = 0; k < N; ++k) sum -= SHARED(n, k) * scaled[k];
      next[q][n] = sum;
    }
    if (c < N) {
      UNROLL for (int m = 1; m < N; ++m) if (m > FIRST_ROW(c)) KEEP(i, m, q) = D[q][m];
      UNROLL for (int m = 0; m < N; ++m) KEEP(i, N + m, q) = SHARED(m, c) * own_inverse[q];
      KEEP(i, 2 * N, q) = SHARED(N, c) * own_inverse[q];
      KEEP(i, 2 * N + 1, q) = own_inverse[q];
    }
  }
};

auto substitute = [&]() {
  real after[COLUMNS];  // of section i + 1
  UNROLL for (int q = 0; q < COLUMNS; ++q) after[q] = zero;
  BEGIN_KEPT;
  for (int i = L - 1; i >= 0; --i) {
    NEXT_KEPT(i);
    real x[COLUMNS];
    UNROLL for (int q = 0; q < OWN_ROWS; ++q) {
      x[q] = KEPT(i, 2 * N, q);
      if (i < L - 1) UNROLL for (int m = 0; m < N; ++m) x[q] -= KEPT(i, N + m, q) * AT_MEMBER(after, m);
    }
    UNROLL for (int k = N - 1; k > 0; --k) {
      const real known = AT_MEMBER(x, k);
      UNROLL for (int q = 0; q < OWN_ROWS; ++q) if (q + member < k) x[q] -= KEPT(i, k, q) * known;
    }
    UNROLL for (int q = 0; q < OWN_ROWS; ++q) {
      const int c = q + member;
      after[q] = x[q];
      if (c < N) {
        DX(c, i) = x[q];
        poison += x[q] * zero;
        change = maximum(change, magnitude(x[q]) * (c < PLACES ? (SC)1 : mean_edge));  // a director counts as a turn of its edge
      }
    }
  }
};

// the residual alone of section i, through the factors that are kept; `next` as for `take`
auto eliminate_again = [&](int i, real (&next)[OWN_ROWS]) {
  real x[OWN_ROWS];
  UNROLL for (int q = 0; q < OWN_ROWS; ++q) {
    const int c = q + member;
    x[q] = c < N && moves(i, c) ? RESIDUAL(c, i % T) + next[q] : zero;
    if (i == MID && opening && c < PLACES) x[q] += share(c) * capacity * direction[c % 3];
    next[q] = c < N ? RESIDUAL_NEXT(c, i % T) : zero;
  }
  UNROLL for (int k = 0; k < N; ++k) {
    const real known = AT_MEMBER(x, k);
    UNROLL for (int q = 0; q < OWN_ROWS; ++q) {
      const int c = q + member;
      if (c > k && c < N) x[q] -= OF_COLUMN(i, c, k) * known;
      if (c < N) next[q] -= OF_COLUMN(i, N + c, k) * known;
    }
  }
  UNROLL for (int q = 0; q < OWN_ROWS; ++q) if (q + member < N) KEEP(i, 2 * N, q) = x[q] * KEEP(i, 2 * N + 1, q);
};

// Newton's step from the state X into DX; unless `fresh`, with the Hessian of the solve before
auto solve = [&]() {
  real D[COLUMNS][N], U[COLUMNS][N], next[COLUMNS][N], inverse[N], own_inverse[COLUMNS], before[N], again[OWN_ROWS];
  change = imbalance = poison = zero;
  if (fresh) indefinite = inexact = zero;
  UNROLL for (int q = 0; q < COLUMNS; ++q) UNROLL for (int m = 0; m < N; ++m) next[q][m] = zero;
  UNROLL for (int m = 0; m < N; ++m) before[m] = zero;
  UNROLL for (int q = 0; q < OWN_ROWS; ++q) again[q] = zero;
  for (int i = 0; i < L; ++i) {
    if (i % T == 0) {
      SYNC;
      if (i + member < L) stage_section(i + member);
      SYNC;
      weigh(i, before);
    }
    if (fresh) {
      take(i, D, U, next);
      factorise(D, U, inverse, own_inverse);
      complement(i, D, U, inverse, own_inverse, next);
    } else {
      eliminate_again(i, again);
    }
  }
  substitute();
  change = poison == zero ? change : zero + (SC)1e30;
  imbalance = poison == zero ? imbalance : zero + (SC)1e30;
  change = team_maximum(change); imbalance = team_maximum(imbalance); inexact = team_maximum(inexact);
  SYNC;
};
