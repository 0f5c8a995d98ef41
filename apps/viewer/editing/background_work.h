#pragma once

#include <condition_variable>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "levelset/error.h"

namespace viewer {

/// Works on requests in a background thread. A newer request replaces one that waits. The work may
/// publish several results, each better than the one before.
template <class Request, class Result>
class BackgroundWork {
 public:
  /// Work on one request. It publishes its results.
  using Work = std::function<void(const Request&, BackgroundWork&)>;
  /// Makes the result that tells of an error. @param message  a sentence
  using Failed = std::function<Result(const Request&, const std::string& message)>;

  /// @param wake  called from the working thread when a result is available
  BackgroundWork(Work work, Failed failed, std::function<void()> wake)
      : work_(std::move(work)),
        failed_(std::move(failed)),
        wake_(std::move(wake)),
        thread_([this] { run(); }) {}
  ~BackgroundWork() {
    {
      const std::scoped_lock lock(mutex_);
      isEnding_ = true;
    }
    changed_.notify_all();
    thread_.join();
  }
  BackgroundWork(const BackgroundWork&) = delete;
  BackgroundWork& operator=(const BackgroundWork&) = delete;

  void request(Request request) {
    {
      const std::scoped_lock lock(mutex_);
      pending_ = std::move(request);
    }
    changed_.notify_all();
  }
  /// Newest result; null before the first one.
  [[nodiscard]] std::shared_ptr<const Result> result() const {
    const std::scoped_lock lock(mutex_);
    return result_;
  }
  [[nodiscard]] bool isBusy() const {
    const std::scoped_lock lock(mutex_);
    return isWorking_ || pending_;
  }

  // For the work.
  void publish(Result result) {
    {
      const std::scoped_lock lock(mutex_);
      result_ = std::make_shared<const Result>(std::move(result));
    }
    if (wake_) wake_();
  }
  [[nodiscard]] bool isEnding() const {
    const std::scoped_lock lock(mutex_);
    return isEnding_;
  }
  /// Returns true if a newer request, or the end, makes the present one obsolete.
  [[nodiscard]] bool isObsolete() const {
    const std::scoped_lock lock(mutex_);
    return isEnding_ || pending_;
  }

 private:
  void run() {
    for (;;) {
      Request request;
      {
        std::unique_lock lock(mutex_);
        isWorking_ = false;
        changed_.wait(lock, [&] { return isEnding_ || pending_; });
        if (isEnding_) return;
        request = *std::exchange(pending_, std::nullopt);
        isWorking_ = true;
      }
      try {
        work_(request, *this);
      } catch (const levelset::Cancelled&) {
        // A newer request follows, or the end.
      } catch (const std::exception& error) {
        tellOf(request, error);
      }
    }
  }

  /// Publishes the result that tells of an error.
  void tellOf(const Request& request, const std::exception& error) noexcept {
    try {
      publish(failed_(request, error.what()));
    } catch (...) {
      // Memory may have run out. The next request may succeed, so the thread goes on.
    }
  }

  Work work_;
  Failed failed_;
  std::function<void()> wake_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<Request> pending_;
  std::shared_ptr<const Result> result_;
  bool isWorking_ = false, isEnding_ = false;
  std::thread thread_;
};

}  // namespace viewer
