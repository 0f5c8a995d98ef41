#include "apps/pipeline/run/step_measures.h"

#include <pthread.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <utility>

#include "apps/process_cost.h"
#include "levelset/grids/sample.h"
#include "levelset/inspect/check.h"

namespace pipeline {
namespace {

double threadCpuSeconds(pthread_t thread) {
  clockid_t clock{};
  timespec time{};
  if (pthread_getcpuclockid(thread, &clock) != 0 || clock_gettime(clock, &time) != 0) return 0;
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

}  // namespace

void estimateError(const Value& value, const Invocation& invocation, StepNotes& notes) {
  if (value.kind() == Kind::Band) {
    const levelset::CheckReport report = levelset::check(value.band());
    notes.errors.push_back({"eikonal residual, mean", report.eikonalMean, ""});
  } else if (value.kind() == Kind::Mesh && !invocation.operands.empty() &&
             invocation.operands[0].kind() == Kind::Band) {
    const levelset::NarrowBand& band = invocation.band();
    const levelset::BandSampler phi(band, levelset::Interpolation::Tricubic);
    const levelset::TriMesh& mesh = value.mesh();
    double worst = 0, sum = 0;
    for (const auto& t : mesh.triangles) {
      const Imath::V3d centre =
          (mesh.positions[t[0]] + mesh.positions[t[1]] + mesh.positions[t[2]]) / 3.0;
      const double distance = std::abs(phi.value(centre)) / band.voxelSize();
      worst = std::max(worst, distance);
      sum += distance;
    }
    notes.errors.push_back(
        {"distance of face centres to the zero set, mean",
         sum / static_cast<double>(std::max<std::size_t>(1, mesh.triangles.size())), "voxels"});
    notes.errors.push_back({"distance of face centres to the zero set, largest", worst, "voxels"});
  }
}

void describeResult(const Value& value, bool dryRun, StepReport& step) {
  step.resultKind = kindName(value.kind());
  if (value.kind() == Kind::Band || value.kind() == Kind::Surface) {
    step.voxelSize = value.plan().voxelSize;
    step.halfWidth = value.plan().halfWidth;
    step.activeVoxels =
        dryRun ? value.plan().activeVoxels() : static_cast<double>(value.band().activeVoxelCount());
  } else if (value.kind() == Kind::Mesh && !dryRun) {
    step.triangles = value.mesh().triangles.size();
  }
}

ArenaCpu::ArenaCpu(tbb::task_arena& arena) : tbb::task_scheduler_observer(arena) {
  observe(true);
}

ArenaCpu::~ArenaCpu() {
  observe(false);
}

void ArenaCpu::on_scheduler_entry(bool) {
  const std::lock_guard lock(mutex_);
  since_.emplace(pthread_self(), threadCpuSeconds(pthread_self()));
}

void ArenaCpu::on_scheduler_exit(bool) {
  const std::lock_guard lock(mutex_);
  const auto own = since_.find(pthread_self());
  if (own == since_.end()) return;
  past_ += threadCpuSeconds(pthread_self()) - own->second;
  since_.erase(own);
}

double ArenaCpu::seconds() const {
  const std::lock_guard lock(mutex_);
  double sum = past_;
  for (const auto& [thread, before] : since_) sum += threadCpuSeconds(thread) - before;
  return sum;
}

void RunningSteps::add(StepClock& clock) {
  const std::lock_guard lock(mutex_);
  updatePeaks();
  if (resetsPeaks_) apps::resetPeakResident();
  clocks_.push_back(&clock);
  if (clocks_.size() < 2) return;
  for (StepClock* const running : clocks_) running->isAlone_ = false;
}

void RunningSteps::remove(StepClock& clock) {
  const std::lock_guard lock(mutex_);
  updatePeaks();
  clocks_.erase(std::find(clocks_.begin(), clocks_.end(), &clock));
}

void RunningSteps::resetPeak() {
  const std::lock_guard lock(mutex_);
  if (resetsPeaks_ && clocks_.empty()) apps::resetPeakResident();
}

void RunningSteps::updatePeaks() {
  if (clocks_.empty()) return;
  const double peak = apps::peakResidentBytes();
  for (StepClock* const running : clocks_)
    running->step_.peakBytes = std::max(running->step_.peakBytes, peak);
}

StepClock::StepClock(StepReport& step, RunningSteps& running, const ArenaCpu* arena)
    : step_(step), running_(running), arena_(arena) {
  running_.add(*this);
  start_ = std::chrono::steady_clock::now();
  cpu_ = apps::processCpuSeconds();
}

void StepClock::stop() {
  if (std::exchange(isStopped_, true)) return;
  step_.wallSeconds +=
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  const double all = apps::processCpuSeconds() - cpu_;
  running_.remove(*this);
  step_.cpuSeconds += isAlone_ || !arena_ ? all : arena_->seconds();
}

}  // namespace pipeline
