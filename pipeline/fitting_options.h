// Whether what was asked for fits the input, before anything is started.
#pragma once

#include "pipeline/input_kind.h"
#include "pipeline/options.h"

namespace lumi {

// Throw UsageError, or InputError where a file that an option names is not there.
void RequireOptionsForKind(const PipelineOptions& options, InputKind kind);
// Refuses an input and an output of which one lies in the other.
void RequireSeparatePaths(const PipelineOptions& options, InputKind kind);

}  // namespace lumi
