// Kernels of the ray casting of Bézier volumes. Each is a program of its own. `heads` and `points`
// are the nodes of one level. A pair has three numbers: node, ray, and the pair of a ray and a shared
// node below which it is. Lists have counters of entries in front of their nodes.

const int kPairsOfBox = 0, kNodesOfBox = 1, kPairsOfFrame = 2, kNodesOfFrame = 3, kOpenPairs = 4;
const int kRootsFound = 5, kKeptPairs = 6, kSplitNodes = 7, kOverruns = 8, kUnfinished = 9;
const int kCounters = 16;
const uint kInBox = 1u, kInFrame = 2u, kIsSplit = 4u;

#ifdef USES_PAIRS
void append(int counter, uint node, uint ray, uint origin) {
  uint at = 3u * atomicAdd(lists[counter], 1u);
  pairsOut[at] = node;
  pairsOut[at + 1u] = ray;
  pairsOut[at + 2u] = origin;
}
#endif

#if defined(USES_MARKS) && defined(USES_PAIRS)
// Appends a node to a list unless it is there. @param place  number of the list
void list(int counter, int place, uint bit, uint node) {
  if ((atomicOr(marks[2u * node], bit) & bit) != 0u) return;
  lists[uint(kCounters + place * nodeCount) + atomicAdd(lists[counter], 1u)] = node;
}
#endif

#if defined(KERNEL_BOX)
// Pairs of rays with the children of the nodes that are split, by the boxes on the screen.
void run(int n) {
  int pair = 3 * (n / childCount);
  int slot = slots[pairsIn[pair]];
  if (slot < 0) return;
  int child = slot + n % childCount;
  uint ray = pairsIn[pair + 1];
  int at = kHead * child;
  int flags = flagsOf(child);
  if ((flags & kKept) == 0 || heads[at + kLeastDepth] > rays[2 * rayCount + int(ray)]) return;
  double x = rays[2u * ray];
  double y = rays[2u * ray + 1u];
  bool isMet = (flags & kCrossesEye) != 0
                   ? mayCross(child, x, y)
                   : !(x < heads[at + kLeft] || x > heads[at + kRight] || y < heads[at + kTop] ||
                       y > heads[at + kBottom]);
  if (!isMet) return;
  append(kPairsOfBox, uint(child), ray, pairsIn[pair + 2]);
  list(kNodesOfBox, 0, kInBox, uint(child));
}

#elif defined(KERNEL_FRAME)
void run(int n) { addFrame(int(lists[kCounters + n])); }

#elif defined(KERNEL_IN_FRAME)
void run(int n) {
  uint node = pairsIn[3 * n];
  uint ray = pairsIn[3 * n + 1];
  if (!isInFrame(int(node), rays[2u * ray], rays[2u * ray + 1u])) return;
  append(kPairsOfFrame, node, ray, pairsIn[3 * n + 2]);
  list(kNodesOfFrame, 1, kInFrame, node);
}

#elif defined(KERNEL_PROVE)
void run(int n) { prove(int(lists[kCounters + nodeCount + n / 3]), n % 3); }

#elif defined(KERNEL_SOLVE)
// Solves pairs of a ray and a node, as TreeWalk::solve(), isExcluded() and addCentre(). One jet is
// computed in each iteration. Pairs that need more than `mostJets` go on in the next call.
const int kStart = 0, kNewton = 1, kExclude = 2, kAtCentre = 3, kDone = 4, kOpen = 5;

void addRoot(int node, uint ray, Three u, Three change, bool isSingular) {
  int at = kRootNumbers * int(atomicAdd(lists[kRootsFound], 1u));
  int head = kHead * node;
  roots[at] = double(ray);
  roots[at + 1] = isSingular ? 1.0lf : 0.0lf;
  for (int i = 0; i < 6; ++i) roots[at + 2 + i] = heads[head + kLevel + i];
  roots[at + 8] = u.x;
  roots[at + 9] = u.y;
  roots[at + 10] = u.z;
  roots[at + 11] = change.x;
  roots[at + 12] = change.y;
  roots[at + 13] = change.z;
  for (int c = 0; c < N; ++c) {
    roots[at + 14 + c] = jetValue[c];
    roots[at + 14 + N + c] = jetU[c];
    roots[at + 14 + 2 * N + c] = jetV[c];
    roots[at + 14 + 3 * N + c] = jetW[c];
  }
}

void run(int n) {
  int pair = 3 * (firstPair + n);
  int node = int(pairsIn[pair]);
  uint ray = pairsIn[pair + 1];
  double x = rays[2u * ray];
  double y = rays[2u * ray + 1u];
  int flags = flagsOf(node);
  bool isDeepest = heads[kHead * node + kLevel] >= double(kDeepestLevel);
  int open = isDeepest ? ((flags & kCrossesEye) != 0 ? kDone : kAtCentre) : kOpen;
  int state = isResumed ? int(states[5 * n + 4]) : kStart;
  if (state >= kDone) return;
  Three u;
  int steps = 0;
  if (state == kStart) {
    u.x = startOf(node, 0, x, y);
    u.y = startOf(node, 1, x, y);
    u.z = startOf(node, 2, x, y);
    state = isUnique(node) ? kNewton : open;
  } else {
    u.x = states[5 * n];
    u.y = states[5 * n + 1];
    u.z = states[5 * n + 2];
    steps = int(states[5 * n + 3]);
  }
  for (int jets = 0; jets < mostJets && state < kDone; ++jets) {
    Three at = u;
    if (state == kExclude) {
      at.x = held(u.x, 0.0lf, 1.0lf);
      at.y = held(u.y, 0.0lf, 1.0lf);
      at.z = held(u.z, 0.0lf, 1.0lf);
    } else if (state == kAtCentre) {
      at.x = 0.5lf;
      at.y = 0.5lf;
      at.z = 0.5lf;
    }
    computeJet(node, at.x, at.y, at.z);
    Three change;
    bool hasRoot = false;
    bool isSingular = state == kAtCentre;
    if (state == kAtCentre) {
      change.x = 0.0lf;
      change.y = 0.0lf;
      change.z = 0.0lf;
      hasRoot = true;
    } else if (state == kExclude) {
      state = isExcluded(node, x, y, u) ? kDone : open;
    } else if (!newtonStep(x, y, change)) {
      state = open;
    } else {
      ++steps;
      precise double ux = u.x + change.x;
      precise double uy = u.y + change.y;
      precise double uz = u.z + change.z;
      u.x = ux;
      u.y = uy;
      u.z = uz;
      bool isBounded = isFinite(change.x) && isFinite(change.y) && isFinite(change.z);
      double size = greater(greater(magnitude(change.x), magnitude(change.y)), magnitude(change.z));
      precise double outX = magnitude(ux - 0.5lf) - 0.5lf;
      precise double outY = magnitude(uy - 0.5lf) - 0.5lf;
      precise double outZ = magnitude(uz - 0.5lf) - 0.5lf;
      double outside = greater(greater(greater(0.0lf, outX), outY), outZ);
      if (!isBounded || !(size < 1e3lf) || outside > 1.0lf)
        state = kExclude;
      else if (size > kLastStep)
        state = steps < kMostNewtonSteps ? kNewton : open;
      else if (outside > kFaceTolerance)
        state = kExclude;
      else
        hasRoot = true;
    }
    if (hasRoot) {
      addRoot(node, ray, isSingular ? at : u, change, isSingular);
      state = kDone;
    }
  }
  states[5 * n] = u.x;
  states[5 * n + 1] = u.y;
  states[5 * n + 2] = u.z;
  states[5 * n + 3] = double(steps);
  states[5 * n + 4] = double(state);
  if (state == kOpen) append(kOpenPairs, uint(node), ray, pairsIn[pair + 2]);
  if (state < kDone) atomicAdd(lists[kUnfinished], 1u);
}

#elif defined(KERNEL_KEEP)
// Counts the undecided nodes of rays, and lists the nodes to split.
void run(int n) {
  uint node = pairsIn[3 * n];
  uint ray = pairsIn[3 * n + 1];
  uint origin = pairsIn[3 * n + 2];
  if (atomicAdd(visits[origin], 1u) + 1u >= uint(mostVisits)) {
    if (atomicExchange(visits[originCount + int(ray)], 1u) == 0u) atomicAdd(lists[kOverruns], 1u);
    return;
  }
  append(kKeptPairs, node, ray, origin);
  list(kSplitNodes, 2, kIsSplit, node);
  atomicAdd(marks[2u * node + 1u], 1u);
}

#elif defined(KERNEL_HALVE)
// Halves a row of control points along one axis by the de Casteljau algorithm. The children of the
// node n lie at 8 n. The axes are halved one after the other.
void run(int n) {
  int size = pointCount() * N;
  int order = axis == 0 ? order0 : (axis == 1 ? order1 : order2);
  int stride = axis == 0 ? order1 * order2 * N : (axis == 1 ? order2 * N : N);
  int rows = size / order;
  int part = n / rows;  // of parents, halves or quarters
  int row = n % rows;
  int inNode = row / stride * stride * order + row % stride;
  int entry = axis == 0 ? part : (axis == 1 ? part >> 1 : part >> 2);
  int within = axis == 0 ? 0 : (axis == 1 ? 4 * (part & 1) : 2 * (part & 3));
  int left = (8 * entry + within) * size + inNode;
  int right = left + (axis == 0 ? 4 : (axis == 1 ? 2 : 1)) * size;
  int from = axis == 0 ? parents[entry] * size + inNode : left;
  double numbers[kMostOrder];
  for (int i = 0; i < order; ++i)
    numbers[i] = axis == 0 ? parentPoints[from + i * stride] : points[from + i * stride];
  points[left] = numbers[0];
  for (int step = 1; step < order; ++step) {
    for (int i = 0; i < order - step; ++i) {
      precise double middle = 0.5lf * (numbers[i] + numbers[i + 1]);
      numbers[i] = middle;
    }
    points[left + step * stride] = numbers[0];
  }
  for (int i = 0; i < order; ++i) points[right + i * stride] = numbers[i];
}

#elif defined(KERNEL_BOUND)
// Sets the heads of children.
void run(int n) {
  int from = kHead * parents[n >> 3];
  int at = kHead * n;
  for (int i = 0; i < 5; ++i) heads[at + kScale + i] = parentHeads[from + kScale + i];
  heads[at + kPatch] = parentHeads[from + kPatch];
  heads[at + kPatch + 1] = parentHeads[from + kPatch + 1];
  precise double level = parentHeads[from + kLevel] + 1.0lf;
  heads[at + kLevel] = level;
  for (int c = 0; c < 3; ++c) {
    precise double cell = 2.0lf * parentHeads[from + kCell + c] + double((n >> (2 - c)) & 1);
    heads[at + kCell + c] = cell;
  }
  marks[2 * n] = 0u;
  marks[2 * n + 1] = 0u;
  bound(n, view[0], view[1]);
}
#endif

void main() {
  int n = first + int(gl_GlobalInvocationID.x);
  if (n < count) run(n);
}
