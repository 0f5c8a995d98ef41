#include "levelset/advection/characteristic.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace levelset::flow {
namespace {

using Imath::V3d;

constexpr std::size_t kStages = 6;
constexpr std::array<double, kStages> kTime = {0, 1.0 / 5, 3.0 / 10, 3.0 / 5, 1, 7.0 / 8};
constexpr std::array<std::array<double, 5>, kStages> kStagePosition = {
    {{0, 0, 0, 0, 0},
     {1.0 / 5, 0, 0, 0, 0},
     {3.0 / 40, 9.0 / 40, 0, 0, 0},
     {3.0 / 10, -9.0 / 10, 6.0 / 5, 0, 0},
     {-11.0 / 54, 5.0 / 2, -70.0 / 27, 35.0 / 27, 0},
     {1631.0 / 55296, 175.0 / 512, 575.0 / 13824, 44275.0 / 110592, 253.0 / 4096}}};
constexpr std::array<double, kStages> kMove = {37.0 / 378,  0, 250.0 / 621,
                                               125.0 / 594, 0, 512.0 / 1771};
constexpr std::array<double, kStages> kFourth = {
    2825.0 / 27648, 0, 18575.0 / 48384, 13525.0 / 55296, 277.0 / 14336, 1.0 / 4};

/// Returns the velocities at the six stages of a step.
/// @param seen  called with each velocity, its position and time
template <typename Seen>
std::array<V3d, kStages> velocitiesOn(const Velocity& velocity, const V3d& from, double time,
                                      double to, const Seen& seen) {
  const double dt = to - time;
  std::array<V3d, kStages> k;
  for (std::size_t stage = 0; stage < kStages; ++stage) {
    V3d position = from;
    for (std::size_t i = 0; i < stage; ++i) position += k[i] * (dt * kStagePosition[stage][i]);
    // With rounding, time + dt could lie beyond the end of the time interval.
    const double at = kTime[stage] == 1 ? to : time + dt * kTime[stage];
    k[stage] = velocity(position, at);
    seen(k[stage], position, at);
  }
  return k;
}

}  // namespace

Characteristic::Characteristic(const Velocity& velocity, const V3d& from, double time, double to) {
  const double dt = to - time;
  const auto k =
      velocitiesOn(velocity, from, time, to, [&](const V3d& u, const V3d& position, double) {
        const double reach = u.length() * std::abs(dt);
        if (std::isfinite(reach)) {
          fastest = std::max(fastest, reach);
        } else {
          fastest = HUGE_VAL;
          nonFiniteDistance = std::min(nonFiniteDistance, (position - from).length());
        }
      });
  for (std::size_t stage = 0; stage < kStages; ++stage) {
    move += k[stage] * (dt * kMove[stage]);
    error += k[stage] * (dt * (kMove[stage] - kFourth[stage]));
  }
  stageDeviation = (k[1] - k[0] - (k[2] - k[0]) * (2.0 / 3)).length() * std::abs(dt);
}

void requireFinitePath(const TimeInterval& interval, const V3d& from, double time, double to) {
  (void)velocitiesOn(interval.velocity, from, time, to,
                     [&](const V3d& u, const V3d& position, double at) {
                       requireFinite(interval, u, position, at);
                     });
}

}  // namespace levelset::flow
