// What the law `rubber` adds along an edge to the neo-Hookean material: shape of the curve, softening, relaxation and flow.
//
// Of an edge at stretch l = |g|, incompressible and pulled along, the relaxed nominal stress is that of Biderman's first
// three terms, Mooney's share m and the upturn c,
//
//   p(l) = mu (l - l^-2) (1 - m + m/l + c (I1 - 3)),  I1 - 3 = l^2 + 2/l - 3,
//
// of which material.h gives mu (l - l^-2) and `extra` the rest. Below l = 0.7, where a thin band buckles, p goes on straight,
// so that it grows with l for every -1 <= m <= 1 and c >= 0.
//
// A band that was stretched before is softer up to that stretch (Mullins): with the work W(l) of p from rest and the
// largest W that an edge has seen, Wm, it pulls with eta p (Ogden, Roxburgh 1999, with a rational function for the erf that
// joins the virgin curve without a kink, which Newton's method would not like),
//
//   eta = 1 - (2 + e) s x^2 / (x^2 + x + e),  x = max(1 - W/Wm, 0),  e = 0.05:  from 1 where it was stretched to, to 1 - s at
// rest, in tension; in compression eta is 1.
//
// Its free energy at a given Wm is the integral of eta p, which grows with l; where Wm grows, a part of that is lost.
//
// Branch k adds w (p(l) - p(q)), q' p'(q) = (p(l) - p(q))/t: it forgets the stress over its time t. Its free energy is
// w [W(l) - W(q) - p(q) (l - q)], p = W': never negative, as W is convex; and it loses w (l - q) (p(l) - p(q))/t of it,
// never negative either, as p grows. With the overstress o = p(l) - p(q) this is o' = p' - o/t: linear, and exact over a
// step in which p is linear in time,
//
//   o = forget o_before + follow (p - p_before),   forget = exp(-h/t),  follow = (1 - forget) t/h
//
// A last branch adds flow (p(l) - p(q)). Its stress flows the faster, the larger it is, by its fourth power as in Bergstrom
// and Boyce (1998), o' = p' - r |o/E|^3 o, so that cycles lose work at every speed. Its free energy and its loss are those of
// the other branches, with r |o/E|^3 in place of 1/t. A step lets it flow by implicit Euler at the rate that it begins with,
//
//   o = o_before/(1 + h r |o_before/E|^3) + p - p_before
//
// Memory is one number an edge and branch. It knows the stretch alone: a rigid turn changes nothing.

const int BRANCHES = STEP_FOLLOW - STEP_FORGET;
const real mooney = law[MATERIAL_MOONEY], upturn = law[MATERIAL_UPTURN], softening = law[MATERIAL_SOFTENING], weight = law[MATERIAL_RELAXATION];
const real flow = law[MATERIAL_FLOW], flow_rate = law[MATERIAL_FLOW_RATE];
real following = zero;  // what a step adds of p's change: w times the sum of `follow`, and flow
#define MEMORY(k, i) stored[(9 * DOFS + (k)) * SECTIONS + (i)]  // overstress of the branches, then:
#define STRESS_BEFORE BRANCHES
#define CARRIED (BRANCHES + 1)                       // what a step adds whatever its end is
#define WORST (BRANCHES + 2)                         // largest work, over mu
#define FLOWING (BRANCHES + 3)                       // overstress of the flowing branch
#define JOIN 0.05                                    // e

// p and `extra` at a stretch, with their slopes by it, and the work of p over mu, 0 in compression
auto uniaxial = [&](real l, real &p, real &slope, real &extra, real &extra_slope, real &work) {
  const real at = maximum(l, zero + (scalar)0.7), i = one / at, i3 = i * i * i, beyond = l - at;
  const real neo = at - i * i, neo_slope = one + (scalar)2 * i3, first = at * at + (scalar)2 * i - (scalar)3;
  extra_slope = mu * (mooney * ((scalar)3 * i3 * i - neo_slope) + upturn * (first * neo_slope + (scalar)2 * neo * neo));
  extra = mu * (mooney * (i - one) + upturn * first) * neo + extra_slope * beyond;
  slope = mu * neo_slope + extra_slope;
  p = mu * (neo + neo_slope * beyond) + extra;
  const real second = (scalar)2 * at + i * i - (scalar)3;  // I2 - 3
  work = at > one ? (scalar)0.5 * (first + mooney * (second - first)) + (scalar)0.25 * upturn * first * first : zero;
};
// how much steeper p is than the neo-Hookean: damping follows the rate of the stress
auto steeper = [&](const real* predicted) -> real {
  const real at = maximum(SQRT(dot(predicted, predicted)), zero + (scalar)0.7), i = one / at, i3 = i * i * i;
  const real neo = at - i * i, per = one / (one + (scalar)2 * i3), first = at * at + (scalar)2 * i - (scalar)3;
  return one + mooney * ((scalar)3 * i3 * i * per - one) + upturn * (first + (scalar)2 * neo * neo * per);
};
// to the stress of a stretch g and its derivative
auto add_law = [&](int i, const real (&g)[3], real (&stress)[3], real (&K)[3][3]) {
  const real l = SQRT(dot(g, g) + (scalar)1e-12);
  real p, slope, extra, extra_slope, work;
  uniaxial(l, p, slope, extra, extra_slope, work);
  const real worst = MEMORY(WORST, i), gap = maximum(worst - work, zero), join = (scalar)JOIN * worst * worst;
  const real per = one / maximum(gap * (gap + worst) + join, zero + (scalar)1e-30), tension = work > zero ? one : zero;
  const real soft = (scalar)(2 + JOIN) * softening * tension * gap * per, lost = soft * gap;
  const real regained = soft * (gap * worst + (scalar)2 * join) * per / mu;  // of eta, by work
  const real pull = extra + MEMORY(CARRIED, i) + (following - lost) * p, across = pull / l;
  const real along = (extra_slope + (following - lost) * slope + regained * p * p - across) / (l * l);
  UNROLL for (int m = 0; m < 3; ++m) {
    stress[m] += across * g[m];
    if (fresh) UNROLL for (int n = 0; n < 3; ++n) K[m][n] += along * g[m] * g[n] + (m == n ? across : zero);
  }
};
// what is left of the flowing branch's overstress o after h
auto unflowed = [&](scalar h, real o) -> real {
  const real strain = o / (mu * (scalar)3), square = strain * strain;
  return o / (one + (zero + h) * flow_rate * square * SQRT(square));
};
// of a step; one that relaxes begins with branches that have forgotten part of whatever stress there will be
auto follow_of = [&](const scalar* row, bool relax, int k) -> real { return relax ? lane[LANE_UNRELAXED + k] : zero + row[STEP_FOLLOW + k]; };
auto recall = [&](const scalar* row, bool relax) {
  real follow = zero;
  UNROLL for (int k = 0; k < BRANCHES; ++k) follow += follow_of(row, relax, k);
  following = weight * follow + flow * (relax ? lane[LANE_UNFLOWED] : one);
  for (int i = member; i < SECTIONS - 1; i += TEAM) {
    real carried = relax ? zero : -follow * MEMORY(STRESS_BEFORE, i);
    if (!relax) UNROLL for (int k = 0; k < BRANCHES; ++k) carried += row[STEP_FORGET + k] * MEMORY(k, i);
    carried *= weight;
    if (!relax) carried += flow * (unflowed(row[STEP_H], MEMORY(FLOWING, i)) - MEMORY(STRESS_BEFORE, i));
    MEMORY(CARRIED, i) = carried;
  }
};
auto stress_at = [&](int i, real &work) -> real {
  real square = zero, p, slope, extra, extra_slope;
  UNROLL for (int c = 0; c < 3; ++c) { const real gap = NOW(c, i + 1) - NOW(c, i); square += gap * gap; }
  uniaxial(SQRT(square) / edge[i], p, slope, extra, extra_slope, work);
  return p;
};
auto begin_memory = [&]() {
  for (int i = member; i < SECTIONS - 1; i += TEAM) {
    real work;
    UNROLL for (int k = 0; k < BRANCHES; ++k) MEMORY(k, i) = zero;
    MEMORY(FLOWING, i) = zero;
    MEMORY(STRESS_BEFORE, i) = stress_at(i, work);
    MEMORY(WORST, i) = lane[LANE_WORST];
  }
};
auto remember = [&](const scalar* row, bool relax) {
  for (int i = member; i < SECTIONS - 1; i += TEAM) {
    real work;
    const real p = stress_at(i, work), change = relax ? p : p - MEMORY(STRESS_BEFORE, i);
    MEMORY(WORST, i) = maximum(relax ? zero + lane[LANE_WORST] : MEMORY(WORST, i), work);  // a guess stretches nothing
    UNROLL for (int k = 0; k < BRANCHES; ++k) {
      const real before = relax ? zero : row[STEP_FORGET + k] * MEMORY(k, i);
      MEMORY(k, i) = before + follow_of(row, relax, k) * change;
    }
    MEMORY(FLOWING, i) = relax ? lane[LANE_UNFLOWED] * change : unflowed(row[STEP_H], MEMORY(FLOWING, i)) + change;
    MEMORY(STRESS_BEFORE, i) = p;
  }
};
