// Summaries of single commands for people; DescribeProxy (commands.h) knows which is which.
#pragma once

#include <string>

#include "proxy/hull/soundness.h"

namespace lumi {

std::string DescribeInfo(const std::string& json);
std::string DescribeAuto(const std::string& json);

// Of a surface that may be a room's, whose fronts look inwards: which way they look is no flaw.
std::string DescribeSurface(const Soundness& sound);

}  // namespace lumi
