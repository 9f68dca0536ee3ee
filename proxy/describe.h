// Summaries of single commands for people; DescribeProxy (commands.h) knows which is which.
#pragma once

#include <string>

namespace lumi {

std::string DescribeInfo(const std::string& json);
std::string DescribeAuto(const std::string& json);

}  // namespace lumi
