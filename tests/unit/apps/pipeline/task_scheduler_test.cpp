// Scheduling of dependent tasks on several threads, and of branches of a graph.

#include "apps/pipeline/run/task_scheduler.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <filesystem>
#include <functional>
#include <mutex>
#include <nlohmann/json.hpp>
#include <random>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/command_line.h"
#include "tests/support/measured.h"

namespace task_scheduler_test {

using pipeline::ScheduleResult;
using pipeline::scheduleTasks;
using pipeline::Task;
using std::chrono::milliseconds;
using ContinueCheck = std::function<bool()>;

constexpr auto kAnyTask = [](std::size_t, const std::vector<std::size_t>&) { return true; };

/// Longer than any correct wait on any machine.
constexpr std::chrono::seconds kTimeout(60);

/// Opens once the given number of threads have arrived.
class Gate {
 public:
  void come() {
    const std::lock_guard lock(mutex_);
    ++here_;
    came_.notify_all();
  }
  /// @return true if they arrived in time
  bool await(int count) {
    std::unique_lock lock(mutex_);
    return came_.wait_for(lock, kTimeout, [&] { return here_ >= count; });
  }
  bool pass(int count) {
    come();
    return await(count);
  }

 private:
  std::mutex mutex_;
  std::condition_variable came_;
  int here_ = 0;
};

void raise(std::atomic<int>& most, int to) {
  for (int seen = most; seen < to && !most.compare_exchange_weak(seen, to);) {
  }
}

TEST(TaskScheduler, RunsIndependentTasksConcurrently) {
  Gate gate;
  std::atomic<int> met = 0;
  const ScheduleResult done = scheduleTasks({Task{}, Task{}, Task{{0, 1}}},
                                            {.threads = 2,
                                             .run =
                                                 [&](std::size_t task, const ContinueCheck&) {
                                                   if (task < 2) met += gate.pass(2);
                                                   return true;
                                                 },
                                             .mayStart = kAnyTask});
  EXPECT_EQ(met, 2);
  EXPECT_EQ(done.isDone, (std::vector<char>{1, 1, 1}));
  EXPECT_FALSE(done.failed);
}

TEST(TaskScheduler, UsesAThreadForEachTask) {
  Gate gate;
  std::atomic<int> met = 0;
  scheduleTasks(std::vector<Task>(4), {.threads = 4,
                                       .run =
                                           [&](std::size_t, const ContinueCheck&) {
                                             met += gate.pass(4);
                                             return true;
                                           },
                                       .mayStart = kAnyTask});
  EXPECT_EQ(met, 4);
}

/// Later tasks do not overtake a task that may not start beside others.
TEST(TaskScheduler, DoesNotOvertakeATaskThatMayNotStart) {
  const auto isLarge = [](std::size_t task) { return task == 2; };
  Gate asked, large;
  std::atomic<int> overtaken = 0;
  const ScheduleResult done = scheduleTasks(
      std::vector<Task>(8), {.threads = 2,
                             .run =
                                 [&](std::size_t task, const ContinueCheck&) {
                                   if (task == 0) asked.await(1);
                                   if (isLarge(task)) large.come();
                                   if (task > 2 && !large.await(1)) ++overtaken;
                                   return true;
                                 },
                             .mayStart =
                                 [&](std::size_t task, const std::vector<std::size_t>&) {
                                   if (isLarge(task)) asked.come();
                                   return !isLarge(task);
                                 }});
  EXPECT_EQ(overtaken, 0);
  EXPECT_EQ(std::count(done.isDone.begin(), done.isDone.end(), 1), 8);
}

TEST(TaskScheduler, RespectsThreadLimitAndMayStart) {
  for (const std::size_t threads : {1u, 2u, 3u}) {
    std::atomic<int> running = 0, most = 0, mostLarge = 0, large = 0;
    const auto isLarge = [](std::size_t task) { return task % 2 == 0; };
    const ScheduleResult done = scheduleTasks(
        std::vector<Task>(40), {.threads = threads,
                                .run =
                                    [&](std::size_t task, const ContinueCheck&) {
                                      const int now = ++running, nowLarge = large += isLarge(task);
                                      raise(most, now);
                                      raise(mostLarge, nowLarge);
                                      std::this_thread::sleep_for(milliseconds(1));
                                      large -= isLarge(task);
                                      --running;
                                      return true;
                                    },
                                .mayStart =
                                    [&](std::size_t task, const std::vector<std::size_t>& others) {
                                      return !isLarge(task) ||
                                             std::none_of(others.begin(), others.end(), isLarge);
                                    }});
    EXPECT_LE(most, static_cast<int>(threads));
    EXPECT_EQ(mostLarge, 1);
    EXPECT_EQ(std::count(done.isDone.begin(), done.isDone.end(), 1), 40);
  }
}

/// Random graphs with barriers, skipped tasks and failing tasks.
TEST(TaskScheduler, RespectsEveryDependency) {
  std::mt19937 random(3);
  for (int round = 0; round < 300; ++round) {
    const std::size_t count = 1 + random() % 30;
    std::vector<Task> tasks(count);
    std::vector<int> outcomes(count, 0);  // 1: skipped, 2: fails
    for (std::size_t i = 0; i < count; ++i) {
      for (std::size_t before = 0; before < i; ++before)
        if (random() % 6 == 0) tasks[i].dependencies.push_back(before);
      tasks[i].isBarrier = random() % 6 == 0;
      outcomes[i] = random() % 40 == 0 ? 1 : random() % 40 == 0 ? 2 : 0;
    }
    const std::size_t threads = 1 + random() % 4;
    std::mutex mutex;
    std::vector<char> ended(count, 0), began(count, 0);
    const ScheduleResult done = scheduleTasks(
        tasks, {.threads = threads,
                .run =
                    [&](std::size_t i, const ContinueCheck&) {
                      {
                        const std::lock_guard lock(mutex);
                        EXPECT_FALSE(began[i]);
                        began[i] = 1;
                        for (const std::size_t before : tasks[i].dependencies)
                          EXPECT_TRUE(ended[before]);
                        if (tasks[i].isBarrier) {
                          EXPECT_EQ(std::count(ended.begin(),
                                               ended.begin() + static_cast<std::ptrdiff_t>(i), 1),
                                    static_cast<std::ptrdiff_t>(i));
                        }
                      }
                      if (i % 3 == 0) std::this_thread::yield();
                      if (outcomes[i] == 2) throw std::runtime_error(std::to_string(i));
                      const std::lock_guard lock(mutex);
                      ended[i] = outcomes[i] == 0;
                      return outcomes[i] == 0;
                    },
                .mayStart = kAnyTask});
    EXPECT_EQ(done.isDone, ended);
    // Expected result of running the tasks one after another.
    std::vector<char> reached(count, 0);
    for (std::size_t i = 0; i < count; ++i) {
      const auto isReached = [&](std::size_t before) { return reached[before] != 0; };
      const bool isReady =
          tasks[i].isBarrier
              ? std::all_of(reached.begin(), reached.begin() + static_cast<std::ptrdiff_t>(i),
                            [](char is) { return is != 0; })
              : std::all_of(tasks[i].dependencies.begin(), tasks[i].dependencies.end(), isReached);
      if (isReady && outcomes[i] == 2) {
        ASSERT_TRUE(done.failed);
        EXPECT_EQ(*done.failed, i);
        break;
      }
      reached[i] = isReady && outcomes[i] == 0;
      EXPECT_EQ(done.isDone[i], reached[i]);
    }
    EXPECT_EQ(done.failed.has_value(), done.failure != nullptr);
  }
}

/// A skipped task and its dependents do not block other tasks.
TEST(TaskScheduler, RunsTasksAfterASkippedOne) {
  for (const std::size_t threads : {1u, 2u}) {
    const ScheduleResult done =
        scheduleTasks({Task{}, Task{{}, true}, Task{{1}}, Task{}, Task{{3}}},
                      {.threads = threads,
                       .run = [](std::size_t task, const ContinueCheck&) { return task != 0; },
                       .mayStart = kAnyTask});
    EXPECT_EQ(done.isDone, (std::vector<char>{0, 0, 0, 1, 1})) << threads;
  }
}

TEST(TaskScheduler, CancelsTasksAfterAFailure) {
  Gate gate;
  std::atomic<bool> wasCanceled = false;
  const ScheduleResult done =
      scheduleTasks({Task{}, Task{}, Task{}},
                    {.threads = 2,
                     .run =
                         [&](std::size_t task, const ContinueCheck& shouldContinue) {
                           gate.pass(2);
                           if (task == 0) throw std::runtime_error("first");
                           const auto end = std::chrono::steady_clock::now() + kTimeout;
                           while (shouldContinue() && std::chrono::steady_clock::now() < end)
                             std::this_thread::sleep_for(milliseconds(1));
                           wasCanceled = !shouldContinue();
                           if (wasCanceled) throw std::runtime_error("ended");
                           return true;
                         },
                     .mayStart = kAnyTask});
  EXPECT_TRUE(wasCanceled);
  EXPECT_EQ(done.failed, 0u);
  EXPECT_FALSE(done.isDone[2]);
}

/// Barriers hold later tasks back, so that results do not accumulate.
TEST(TaskScheduler, DoesNotRunFarAhead) {
  std::vector<Task> tasks;
  for (std::size_t i = 0; i < 20; ++i) {
    tasks.push_back({});
    tasks.push_back({.dependencies = {2 * i}, .isBarrier = true});
  }
  std::atomic<int> made = 0, taken = 0, most = 0;
  scheduleTasks(tasks, {.threads = 2,
                        .run =
                            [&](std::size_t task, const ContinueCheck&) {
                              if (task == 0) std::this_thread::sleep_for(milliseconds(50));
                              if (task % 2 == 1) {
                                ++taken;
                                return true;
                              }
                              // Incremented before the check of the consumed count.
                              const int now = ++made;
                              raise(most, now - taken);
                              return true;
                            },
                        .mayStart = kAnyTask});
  EXPECT_EQ(taken, 20);
  EXPECT_LE(most, 2);
}

class Branches : public support::ShellTest {
 protected:
  static std::string balls(int count, const std::string& voxel = "0.05") {
    std::string chain;
    for (int i = 0; i < count; ++i)
      chain += (i == 0 ? "" : " ! ") + std::string("sphere --radius 1 --voxel ") + voxel +
               " ! offset 0." + std::to_string(i + 1) + " ! write o" + std::to_string(i) + ".vdb";
    return chain;
  }

  static double childrenCpuSeconds() {
    rusage used{};
    getrusage(RUSAGE_CHILDREN, &used);
    return static_cast<double>(used.ru_utime.tv_sec + used.ru_stime.tv_sec) +
           1e-6 * static_cast<double>(used.ru_utime.tv_usec + used.ru_stime.tv_usec);
  }
};

TEST_F(Branches, GiveTheResultsOfOneThread) {
  const std::string chain =
      "sphere --radius 1 --voxel 0.03 --as a ! offset 0.1 ! offset -0.1 --as b ! box --size 1,1,3 "
      "--voxel 0.03 ! smooth --sigma 1vx --as c ! union @b @c ! clip --box \"-1,-1,0 1,1,2\" ! "
      "write o.vdb ! difference @a @c ! mesh ! write o.ply ! measure --json";
  const auto alone = levelsmith("--threads 1 " + chain);
  ASSERT_EQ(alone.code, 0) << alone.err;
  const std::string grid = support::slurp(folder_ / "o.vdb"),
                    mesh = support::slurp(folder_ / "o.ply");
  for (int i = 0; i < 3; ++i) {
    const auto beside = levelsmith("--threads 4 " + chain);
    ASSERT_EQ(beside.code, 0) << beside.err;
    EXPECT_EQ(beside.out, alone.out);
    EXPECT_EQ(beside.err, alone.err);
    EXPECT_TRUE(support::slurp(folder_ / "o.vdb") == grid);
    EXPECT_TRUE(support::slurp(folder_ / "o.ply") == mesh);
  }
}

TEST_F(Branches, StopAtTheFirstErrorWithAllEarlierStepsDone) {
  const std::string chain = balls(3) +
                            " ! sphere --radius 1 --voxel 0.05 ! offset -2 ! write bad.vdb"
                            " ! sphere --radius 1 --voxel 0.05 ! write after.vdb";
  std::vector<std::string> told;
  for (const char* threads : {"1", "4"}) {
    const auto ended =
        levelsmith("--report r.json --threads " + std::string(threads) + " " + chain);
    EXPECT_EQ(ended.code, 3) << ended.err;
    for (const char* file : {"o0.vdb", "o1.vdb", "o2.vdb"}) {
      EXPECT_TRUE(exists(file)) << file;
      std::filesystem::remove(folder_ / file);
    }
    EXPECT_FALSE(exists("bad.vdb"));
    EXPECT_FALSE(exists("after.vdb"));
    const auto report = nlohmann::json::parse(support::slurp(folder_ / "r.json"));
    told.push_back(ended.err + report["error"].get<std::string>());
    for (const auto& step : report["steps"]) told.back() += " " + step["action"].get<std::string>();
  }
  EXPECT_EQ(told[0], told[1]);
  EXPECT_NE(told[0].find("offset: "), std::string::npos) << told[0];
}

TEST_F(Branches, RunOneAfterAnotherIfMemoryIsShort) {
  // All branches at once would take 340 MB.
  std::string chain;
  for (int i = 0; i < 4; ++i)
    chain += (i == 0 ? "" : " ! ") +
             std::string("sphere --radius 1 --voxel 0.01 ! offset 0.02 ! ") + "write o" +
             std::to_string(i) + ".vdb";
  const auto apart = levelsmith("--max-memory 240M --threads 4 --report r.json " + chain);
  EXPECT_EQ(apart.code, 0) << apart.err;
  double peak = 0;
  const auto report = nlohmann::json::parse(support::slurp(folder_ / "r.json"));
  for (const auto& step : report["steps"]) peak = std::max(peak, step["peak_bytes"].get<double>());
  EXPECT_LT(peak, 240e6);
}

TEST_F(Branches, AreReportedInOrderIfAMeshIsInvalid) {
  ASSERT_EQ(levelsmith("sphere --radius 1 --voxel 0.05 ! mesh ! write s.ply").code, 0);
  const std::string chain =
      "sphere --radius 1 --voxel 0.02 ! offset 0.3 --as q ! read - --format ply --as r ! box "
      "--size "
      "1,1,1 --voxel .1 --as b ! box --size 1,2,1 --voxel .09 --as c ! union @b @c --as u ! "
      "level-set @r --voxel .05 --as m ! union @u @m @q ! write y.vdb < <(head -c 300 s.ply)";
  const auto alone = levelsmith("--threads 1 " + chain);
  EXPECT_EQ(alone.code, 3);
  EXPECT_EQ(levelsmith("--threads 4 " + chain).err, alone.err);
}

TEST_F(Branches, AreReportedInTheOrderOfTheGraphWithTheirOwnCosts) {
  const double before = childrenCpuSeconds();
  ASSERT_EQ(levelsmith("--report r.json --threads 4 " + balls(4, "0.03")).code, 0);
  const auto report = nlohmann::json::parse(support::slurp(folder_ / "r.json"));
  ASSERT_EQ(report["steps"].size(), 12u);
  double cpu = 0;
  for (std::size_t i = 0; i < 12; ++i) {
    const char* actions[] = {"sphere", "offset", "write"};
    EXPECT_EQ(report["steps"][i]["action"], actions[i % 3]);
    EXPECT_GT(report["steps"][i]["peak_bytes"], 1e6);
    cpu += report["steps"][i]["cpu_s"].get<double>();
  }
  // Each step has its own CPU time. If each step had that of the complete process, the sum would be
  // about twice the time of the process.
  const double all = childrenCpuSeconds() - before;
  EXPECT_LT(cpu, all);
  EXPECT_GT(cpu, 0.4 * all);  // the rest is start-up, mostly
}

TEST_F(Branches, ReadTheFilesOfASceneWrittenBefore) {
  ASSERT_EQ(levelsmith("sphere --radius 1 --voxel 0.05 ! write s-a.vdb").code, 0);
  const std::string chain =
      "sphere --radius 2 --voxel 0.05 --as a ! box --size 1,1,3 --voxel 0.05 --as b ! scene @a @b "
      "! "
      "write s.json ! read ./s-a.vdb ! measure --json";
  const auto alone = levelsmith("--threads 1 " + chain),
             beside = levelsmith("--threads 4 " + chain);
  ASSERT_EQ(alone.code, 0) << alone.err;
  EXPECT_NEAR(nlohmann::json::parse(alone.out)["volume"].get<double>(), 33.5,
              support::measured(0.0103));
  ASSERT_EQ(levelsmith("sphere --radius 1 --voxel 0.05 ! write s-a.vdb").code, 0);
  EXPECT_EQ(levelsmith("--threads 4 " + chain).out, alone.out);
  EXPECT_EQ(beside.out, alone.out);
}

TEST_F(Branches, ReadPipesOnce) {
  ASSERT_EQ(levelsmith("sphere --radius 1 --voxel 0.05 ! mesh ! write s.ply").code, 0);
  // A node that fails on a region of interest is retried on complete values, and the mesh cannot be
  // read again.
  const std::string apart =
      "level-set --voxel 0.05 --as m ! sphere --radius 1 --center 5,0,0 --voxel 0.05 --as s ! "
      "union "
      "@m @s ! clip --box \"4.5,-.5,-.5 6.5,.5,.5\" ! mesh ! write o.ply";
  const auto piped = levelsmith("read - --format ply ! " + apart + " < s.ply");
  EXPECT_EQ(piped.code, 0) << piped.err;
  EXPECT_EQ(levelsmith("read s.ply ! " + apart).code, 0);
  const auto broken = levelsmith(
      "read - --format ply ! level-set --voxel 0.05 ! mesh ! write o.ply "
      "< <(head -c 300 s.ply)");
  EXPECT_EQ(broken.code, 3);
  EXPECT_EQ(broken.err.find("is empty"), std::string::npos) << broken.err;
}

TEST_F(Branches, ReadFilesThatEarlierActionsWrite) {
  const std::string chain =
      "sphere --radius 1 --voxel 0.05 ! offset 0.2 ! offset -0.1 ! write s.vdb ! box --size 1,2,3 "
      "--voxel 0.05 --as b ! read s.vdb ! measure --json ! union @b ! write u.vdb";
  const auto alone = levelsmith("--threads 1 " + chain);
  ASSERT_EQ(alone.code, 0) << alone.err;
  for (int i = 0; i < 3; ++i) {
    std::filesystem::remove(folder_ / "s.vdb");
    const auto beside = levelsmith("--threads 4 " + chain);
    EXPECT_EQ(beside.code, 0) << beside.err;
    EXPECT_EQ(beside.out, alone.out);
  }
}

}  // namespace task_scheduler_test
