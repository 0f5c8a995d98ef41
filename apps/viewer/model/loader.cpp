#include "apps/viewer/model/loader.h"

#include <atomic>
#include <mutex>
#include <thread>

namespace viewer {

struct Loader::Job {
  std::atomic<bool> isCancelled = false;
  std::atomic<double> progress = 0;
  std::mutex mutex;
  std::optional<Result> result;
};

Loader::~Loader() {
  if (job_) job_->isCancelled = true;
}

void Loader::open(const std::vector<std::filesystem::path>& files, long resolution, bool isReload) {
  if (job_) job_->isCancelled = true;
  const auto job = job_ = std::make_shared<Job>();
  // The thread is detached, so that nobody waits for a cancelled job. The thread shares ownership
  // of the job and ends at the next progress report.
  std::thread([job, files, resolution, isReload, wake = wake_] {
    Result result{.files = files, .model = nullptr, .failure = nullptr, .isReload = isReload};
    try {
      const auto report = [&](double fraction) {
        job->progress = fraction;
        return !job->isCancelled;
      };
      result.model = std::make_shared<const Model>(
          openModel(files, {.resolution = resolution, .progress = report}));
    } catch (...) {
      result.failure = std::current_exception();
    }
    if (job->isCancelled) return;
    {
      const std::scoped_lock lock(job->mutex);
      job->result = std::move(result);
    }
    if (wake) wake();
  }).detach();
}

double Loader::progress() const {
  return job_ ? job_->progress.load() : 1;
}

std::optional<Loader::Result> Loader::take() {
  if (!job_) return std::nullopt;
  std::optional<Result> result;
  {
    const std::scoped_lock lock(job_->mutex);
    result = std::move(job_->result);
    job_->result.reset();
  }
  if (result) job_ = nullptr;
  return result;
}

}  // namespace viewer
