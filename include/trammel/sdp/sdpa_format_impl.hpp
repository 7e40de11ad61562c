// SPDX-License-Identifier: Apache-2.0
/// @file
/// Definitions of sdpa_format.hpp.
#pragma once

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <tuple>
#include <vector>

#include "trammel/core/error.hpp"
#include "trammel/sdp/sdpa_format.hpp"

namespace trammel::inline TRAMMEL_ABI::sdp {

namespace detail {

/// Reads a .dat-s text line by line.
class SdpaReader {
 public:
  SdpaReader(std::string_view text, std::string_view name) : rest_(text), name_(name) {}

  [[nodiscard]] Problem read() {
    next_content_line("the number of variables");
    const int variables = positive_integer("the number of variables, a positive whole number");
    next_content_line("the number of blocks");
    const int blocks = positive_integer("the number of blocks, a positive whole number");
    read_block_sizes(blocks);
    read_costs(variables);
    read_entries();
    reject_duplicates();
    return std::move(problem_);
  }

 private:
  static bool is_blank(char c) {
    return c == ' ' || c == '\t' || c == '\r' || c == ',' || c == '(' || c == ')' || c == '{' || c == '}' ||
           c == '\f' || c == '\v';
  }

  [[noreturn]] void fail(const std::string& found, const std::string& expected) const {
    throw Error({name_ + ":" + std::to_string(line_number_), found, expected});
  }

  static std::string quote(std::string_view token) {
    constexpr std::size_t kLongest = 40;
    return "\"" + std::string(token.substr(0, kLongest)) + (token.size() > kLongest ? "...\"" : "\"");
  }

  /// Moves to the next line; false at the end of the text.
  bool next_line() {
    if (rest_.empty()) {
      return false;
    }
    const std::size_t end = rest_.find('\n');
    line_ = rest_.substr(0, end);
    rest_ = end == std::string_view::npos ? std::string_view{} : rest_.substr(end + 1);
    ++line_number_;
    return true;
  }

  /// Moves to the next line with content; false at the end of the text.
  bool find_content_line() {
    while (next_line()) {
      if (!line_.empty() && (line_.front() == '"' || line_.front() == '*')) {
        continue;
      }
      if (!std::all_of(line_.begin(), line_.end(), is_blank)) {
        return true;
      }
    }
    return false;
  }

  void next_content_line(const std::string& expected) {
    if (!find_content_line()) {
      fail("the end of the file", expected);
    }
  }

  /// Next token of the line, empty at its end.
  std::string_view token() {
    while (!line_.empty() && is_blank(line_.front())) {
      line_.remove_prefix(1);
    }
    const auto* const end = std::find_if(line_.begin(), line_.end(), is_blank);
    const std::string_view found = line_.substr(0, static_cast<std::size_t>(end - line_.begin()));
    line_.remove_prefix(found.size());
    return found;
  }

  template <class Number>
  static std::optional<Number> to_number(std::string_view text) {
    if (text.size() > 1 && text.front() == '+' && text[1] != '-' && text[1] != '+') {
      text.remove_prefix(1);
    }
    Number value{};
    const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (end != text.data() + text.size() || text.empty()) {
      return std::nullopt;
    }
    if constexpr (std::is_same_v<Number, double>) {
      if (code == std::errc::result_out_of_range) {
        const double bounded = std::strtod(std::string(text).c_str(), nullptr);
        return std::isfinite(bounded) ? std::optional<double>(bounded)
                                      : std::nullopt;  // tiny: rounds to zero
      }
      if (!std::isfinite(value)) {
        return std::nullopt;
      }
    }
    return code == std::errc() ? std::optional<Number>(value) : std::nullopt;
  }

  int integer(std::string_view text, const std::string& expected) const {
    const std::optional<int> value = to_number<int>(text);
    if (!value) {
      fail(text.empty() ? "the end of the line" : quote(text), expected);
    }
    return *value;
  }

  int positive_integer(const std::string& expected) {
    const std::string_view text = token();
    const int value = integer(text, expected);
    if (value < 1) {
      fail(quote(text), expected);
    }
    return value;
  }

  void read_block_sizes(int count) {
    const std::string expected = std::to_string(count) + " block sizes, whole numbers other than 0";
    line_ = {};  // what follows the number of blocks is a comment
    for (int b = 0; b < count; ++b) {
      const int size = integer(next_token_over_lines(expected), expected);
      if (size == 0 || size == std::numeric_limits<int>::min()) {
        fail(std::to_string(size), expected);
      }
      problem_.blocks.push_back({size > 0 ? BlockKind::kDense : BlockKind::kDiagonal, std::abs(size)});
    }
    reject_further_number(expected);
  }

  void read_costs(int count) {
    const std::string expected = std::to_string(count) + " costs, finite numbers";
    std::vector<double> costs;
    line_ = {};
    for (int i = 0; i < count; ++i) {
      const std::string_view text = next_token_over_lines(expected);
      const std::optional<double> value = to_number<double>(text);
      if (!value) {
        fail(quote(text), expected);
      }
      costs.push_back(*value);
    }
    reject_further_number(expected);
    problem_.cost = Eigen::Map<const Eigen::VectorXd>(costs.data(), count);
  }

  std::string_view next_token_over_lines(const std::string& expected) {
    std::string_view text = token();
    while (text.empty()) {
      next_content_line(expected);
      text = token();
    }
    return text;
  }

  void reject_further_number(const std::string& expected) {
    const std::string_view text = token();
    if (to_number<double>(text)) {
      fail("one more number, " + quote(text), expected);
    }
    line_ = {};
  }

  void read_entries() {
    while (find_content_line()) {
      for (std::string_view text = token(); !text.empty(); text = token()) {
        read_entry(text);
      }
    }
  }

  void read_entry(std::string_view first) {
    const int matrix = integer(first, "an entry: matrix block row column value");
    const int block = integer(token(), "the number of a block");
    const int row = integer(token(), "the number of a row");
    const int column = integer(token(), "the number of a column");
    const std::string_view text = token();
    const std::optional<double> value = to_number<double>(text);
    if (!value) {
      fail(text.empty() ? "the end of the line" : quote(text), "the value of the entry, a finite number");
    }
    const auto variables = static_cast<int>(problem_.cost.size());
    const auto blocks = static_cast<int>(problem_.blocks.size());
    if (matrix < 0 || matrix > variables) {
      fail("matrix " + std::to_string(matrix), "0 to " + std::to_string(variables));
    }
    if (block < 1 || block > blocks) {
      fail("block " + std::to_string(block), "1 to " + std::to_string(blocks));
    }
    const Block& shape = problem_.blocks[static_cast<std::size_t>(block - 1)];
    for (const int index : {row, column}) {
      if (index < 1 || index > shape.size) {
        fail("row or column " + std::to_string(index),
             "1 to " + std::to_string(shape.size) + " in block " + std::to_string(block));
      }
    }
    if (shape.kind == BlockKind::kDiagonal && row != column) {
      fail("row " + std::to_string(row) + ", column " + std::to_string(column),
           "equal row and column, since block " + std::to_string(block) + " is diagonal");
    }
    problem_.entries.push_back(
        {matrix - 1, block - 1, std::min(row, column) - 1, std::max(row, column) - 1, *value});
    lines_.push_back(line_number_);
  }

  void reject_duplicates() {
    std::vector<std::size_t> order(problem_.entries.size());
    for (std::size_t k = 0; k < order.size(); ++k) {
      order[k] = k;
    }
    const auto key = [&](std::size_t k) {
      const Entry& e = problem_.entries[k];
      return std::tuple(e.variable, e.block, e.row, e.column);
    };
    std::sort(order.begin(), order.end(),
              [&](std::size_t a, std::size_t b) { return std::pair(key(a), a) < std::pair(key(b), b); });
    for (std::size_t k = 1; k < order.size(); ++k) {
      if (key(order[k - 1]) == key(order[k])) {
        line_number_ = lines_[order[k]];
        fail("an entry that line " + std::to_string(lines_[order[k - 1]]) + " gave already",
             "each entry once, in one triangle");
      }
    }
    std::erase_if(problem_.entries, [](const Entry& e) { return e.value == 0.0; });
  }

  std::string_view rest_;
  std::string name_;
  std::string_view line_;
  int line_number_ = 0;
  Problem problem_;
  std::vector<int> lines_;
};

template <class Number>
void append_number(std::string& text, Number value) {
  constexpr std::size_t kLongest = 32;
  std::array<char, kLongest> buffer{};
  const auto result = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value);
  text.append(buffer.data(), result.ptr);
}

inline void append_entry(std::string& text, const Entry& e) {
  for (const int index :
       {e.variable + 1, e.block + 1, std::min(e.row, e.column) + 1, std::max(e.row, e.column) + 1}) {
    append_number(text, index);
    text += ' ';
  }
  append_number(text, e.value);
  text += '\n';
}

/// Entries of a problem, each position once, low-rank terms and free blocks written out.
inline std::vector<Entry> plain_entries(const Problem& problem) {
  std::vector<Entry> entries = problem.entries;
  for (Entry& e : entries) {
    std::tie(e.row, e.column) = std::minmax({e.row, e.column});
  }
  for (const LowRankTerm& t : problem.low_rank) {
    const Eigen::MatrixXd full = t.vectors * t.weights.asDiagonal() * t.vectors.transpose();
    for (int c = 0; c < full.cols(); ++c) {
      for (int r = 0; r <= c; ++r) {
        entries.push_back({t.variable, t.block, r, c, full(r, c)});
      }
    }
  }
  const std::size_t count = entries.size();
  for (std::size_t k = 0; k < count; ++k) {
    const Entry& e = entries[k];
    const Block& block = problem.blocks[static_cast<std::size_t>(e.block)];
    if (block.kind == BlockKind::kFree) {
      entries.push_back({e.variable, e.block, e.row + block.size, e.column + block.size, -e.value});
    }
  }
  const auto key = [](const Entry& e) { return std::tuple(e.variable, e.block, e.row, e.column); };
  std::stable_sort(entries.begin(), entries.end(),
                   [&](const Entry& a, const Entry& b) { return key(a) < key(b); });
  std::vector<Entry> merged;
  for (const Entry& e : entries) {
    if (!merged.empty() && key(merged.back()) == key(e)) {
      merged.back().value += e.value;
    } else {
      merged.push_back(e);
    }
  }
  std::erase_if(merged, [](const Entry& e) { return e.value == 0.0; });
  return merged;
}

}  // namespace detail

TRAMMEL_INLINE Problem parse_sdpa(std::string_view text, std::string_view name) {
  return detail::SdpaReader(text, name).read();
}

TRAMMEL_INLINE std::string to_sdpa(const Problem& problem, std::string_view title) {
  validate(problem);
  std::string text;
  if (!title.empty()) {
    text += "* ";
    std::transform(title.begin(), title.end(), std::back_inserter(text),
                   [](char c) { return c == '\n' ? ' ' : c; });
    text += '\n';
  }
  detail::append_number(text, problem.cost.size());
  text += '\n';
  detail::append_number(text, problem.blocks.size());
  text += '\n';
  for (const Block& block : problem.blocks) {
    detail::append_number(text, block.kind == BlockKind::kDense  ? block.size
                                : block.kind == BlockKind::kFree ? -2 * block.size
                                                                 : -block.size);
    text += ' ';
  }
  text += '\n';
  for (const double cost : problem.cost) {
    detail::append_number(text, cost);
    text += ' ';
  }
  text += '\n';
  for (const Entry& e : detail::plain_entries(problem)) {
    detail::append_entry(text, e);
  }
  return text;
}

}  // namespace trammel::inline TRAMMEL_ABI::sdp
