// What a sling is made of, where its state is kept, and what holds during a step.

const int ROW_LENGTH = (N + 3) / 4 * 4;
const int LAST = CHAINS == 2 ? MID : L - 1;  // where a chain ends; SECTION(at) is the section that it comes to as number `at`
#define SECTION(at) (down ? L - 1 - (at) : (at))
const int SAVED = 2 * N + 1 + AGAIN;  // numbers kept of a column: multipliers, coupling, solution, 1 / pivot
#define SET(name) setting.data[SETTING_##name]
const SC mean_edge = SET(MEAN_EDGE), area = SET(AREA), radius2 = SET(RADIUS2);
const SC wind = SET(WIND), line_mass = SET(LINE_MASS), gravity = SET(GRAVITY), node_mass = line_mass * mean_edge;
const SC per_edge = (SC)1 / mean_edge;
const SC* edge = mesh.data;  // rest length of each edge
const SC tolerance = SET(TOLERANCE), step_limit = SET(STEP_LIMIT), shortest = SET(SHORTEST);
const int max_iterations = (int)SET(MAX_ITERATIONS);
const bool first_clamped = SET(CLAMPED) > 0, last_clamped = setting.data[SETTING_CLAMPED + 1] > 0;

const SC node_shift = node_mass * (SC)2.5e5;  // the inertia of a 2 ms step
auto LAW = ROW(coefficients, MATERIAL_SIZE);  // of the material
const real mu = LAW[MATERIAL_MU], lam = LAW[MATERIAL_LAM], bulk = lam - mu / (SC)3, d = LAW[MATERIAL_DAMPING], s = LAW[MATERIAL_SCALE];
const real friction = LAW[MATERIAL_FRICTION], bending = LAW[MATERIAL_BENDING], drag = LAW[MATERIAL_DRAG], turning = LAW[MATERIAL_TURNING];

// degree of freedom k of cross-section i: now, predicted, the y and xh of step.h, Newton's change, and of the two steps before
auto INITIAL = ROW(state, N * L);
auto STATE = ROW(scratch, (9 * N + MEMORIES + 4) * L);
#define FIELD(f, k, i) STATE[((f) * N + (k)) * L + (i)]
#define X(k, i) FIELD(0, k, i)
#define XP(k, i) FIELD(1, k, i)
#define Y(k, i) FIELD(2, k, i)
#define XH(k, i) FIELD(3, k, i)
#define DX(k, i) FIELD(4, k, i)
#define X1(k, i) FIELD(5, k, i)
#define X2(k, i) FIELD(6, k, i)
#define V1(k, i) FIELD(7, k, i)
#define V2(k, i) FIELD(8, k, i)
auto OUT = ROW(output, OUTPUT_SIZE * steps);
auto FRAME = ROW(frames, frame_width * L * n_frames);
auto SAVE_ROWS = SAVE;
#define KEEP(i, row, q) SAVE_ROWS[((i) * SAVED + (row)) * SAVE_STRIDE + (q)]

#if defined(__CUDA_ARCH__)
__shared__ __align__(16) SC rows[2 * CHAINS * (N + 1) * ROW_LENGTH];  // a section's columns, for the whole chain; two sections in turn
#define SHARED(c, k) rows[(((at & 1) * CHAINS + chain) * (N + 1) + (c)) * ROW_LENGTH + (k)]
#define SHARE(U) if (mine <= N) { UNROLL for (int k = 0; k < N; ++k) SHARED(mine, k) = U[0][k]; } SYNC
// the back substitution reads a section ahead, so that it need not wait for the memory
#define BEGIN_KEPT SC now[SAVED], ahead[SAVED]; UNROLL for (int r = 1; r < SAVED; ++r) ahead[r] = KEEP(LAST, r, 0)
#define NEXT_KEPT(i) UNROLL for (int r = 1; r < SAVED; ++r) { now[r] = ahead[r]; ahead[r] = KEEP(i ? i - 1 : 0, r, 0); }
#define KEPT(i, row, q) now[row]
#else
#define BEGIN_KEPT
#define NEXT_KEPT(i)
#define KEPT(i, row, q) KEEP(i, row, q)
#define SHARED(c, k) U[c][k]
#define SHARE(U)
#endif

auto LANE = ROW(lanes, LANE_SIZE);
real direction[3], separation[5], payload = LANE[LANE_PAYLOAD], outcome = zero;
UNROLL for (int c = 0; c < 3; ++c) direction[c] = LANE[LANE_DIRECTION + c];
UNROLL for (int c = 0; c < 5; ++c) separation[c] = zero;

// of the step under way
SC ibh = 0, ibh2 = 0, ct = 0;              // 1 / (beta h), its square; torsion
bool attached = false, gripped = false;    // the hand leads the middle section's places; its pads hold the direction as well
bool opening = false;                      // its fingers open
real capacity = zero;                      // what the pads can hold [N]
real cb = zero, dh = zero, dsh = zero;     // bending, d / (beta h), that times s
real air = zero;                           // drag / (beta h)
#if AGAIN
bool fresh = true;                         // the Hessian is wanted, not the residual alone
#else
const bool fresh = true;
#endif
real shift = zero, inexact = zero;         // of the Hessian: what is added to its diagonal, whether it is not exact
