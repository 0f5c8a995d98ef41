#pragma once

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>

#include "tests/support/command_line.h"

namespace support {

/// Tests of actions by their JSON output and their refusals.
class ActionTest : public ShellTest {
 protected:
  /// JSON that a successful chain prints; null if it fails.
  nlohmann::json json(const std::string& arguments) {
    const Outcome outcome = levelsmith(arguments);
    EXPECT_EQ(outcome.code, 0) << arguments << "\n" << outcome.err;
    return outcome.code == 0 ? nlohmann::json::parse(outcome.out) : nlohmann::json();
  }
  /// Expects that a chain fails with an exit code and a message that contains `part`.
  void expectRefusal(const std::string& arguments, int code, const std::string& part) {
    const Outcome outcome = levelsmith(arguments);
    EXPECT_EQ(outcome.code, code) << arguments << "\n" << outcome.err;
    EXPECT_NE(outcome.err.find(part), std::string::npos) << outcome.err;
  }
};

}  // namespace support
