// The parts of nlohmann's json that most files would each compile for themselves, compiled once (json_instances.cc):
// precompiled with the headers (LUMI_PCH), for no file to include.
#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#ifndef LUMI_JSON_INSTANCES
#define LUMI_JSON_INSTANCES extern
#endif

LUMI_JSON_INSTANCES template class nlohmann::basic_json<>;
LUMI_JSON_INSTANCES template class nlohmann::detail::serializer<nlohmann::json>;
LUMI_JSON_INSTANCES template class nlohmann::detail::json_sax_dom_parser<nlohmann::json>;
// What parses a std::string.
using LumiJsonText = nlohmann::detail::iterator_input_adapter<std::string::const_iterator>;
LUMI_JSON_INSTANCES template class nlohmann::detail::lexer<nlohmann::json, LumiJsonText>;
LUMI_JSON_INSTANCES template class nlohmann::detail::parser<nlohmann::json, LumiJsonText>;
LUMI_JSON_INSTANCES template class std::map<std::string, nlohmann::json, std::less<>>;
LUMI_JSON_INSTANCES template class std::vector<nlohmann::json>;
