// SPDX-License-Identifier: Apache-2.0
#include "kvn.hpp"

#include "trammel/core/error.hpp"

namespace trammel::io {

namespace {

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlank = " \t\r";
  const auto first = text.find_first_not_of(kBlank);
  return first == std::string_view::npos ? std::string_view()
                                         : text.substr(first, text.find_last_not_of(kBlank) - first + 1);
}

bool is_keyword(std::string_view text) {
  return !text.empty() &&
         text.find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_") == std::string_view::npos;
}

bool is_comment(std::string_view line) {
  constexpr std::string_view kComment = "COMMENT";
  return line.substr(0, kComment.size()) == kComment &&
         (line.size() == kComment.size() || line[kComment.size()] == ' ' || line[kComment.size()] == '\t');
}

}  // namespace

std::vector<KvnLine> split_kvn(std::string_view text, const std::string& name) {
  std::vector<KvnLine> lines;
  int number = 0;
  while (!text.empty()) {
    const auto end = text.find('\n');
    const std::string_view content = trimmed(text.substr(0, end));
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    ++number;
    if (content.empty() || is_comment(content)) {
      continue;
    }
    KvnLine line;
    line.number = number;
    const auto equals = content.find('=');
    line.has_value = equals != std::string_view::npos;
    line.keyword = trimmed(content.substr(0, equals));
    line.value = line.has_value ? trimmed(content.substr(equals + 1)) : std::string_view();
    if (!is_keyword(line.keyword)) {
      throw Error({name + ":" + std::to_string(number), "'" + std::string(content) + "'",
                   "KEYWORD = value, the keyword in capitals"});
    }
    if (line.has_value && line.value.empty()) {
      throw Error({name + ":" + std::to_string(number) + ": " + line.keyword, "nothing", "a value"});
    }
    lines.push_back(std::move(line));
  }
  return lines;
}

}  // namespace trammel::io
