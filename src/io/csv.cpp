// SPDX-License-Identifier: Apache-2.0
#include "csv.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "file.hpp"
#include "trammel/core/error.hpp"

namespace trammel::io {

namespace {

constexpr std::string_view kBlank = " \t\r";

std::string_view trim(std::string_view text) {
  const auto first = text.find_first_not_of(kBlank);
  if (first == std::string_view::npos) {
    return {};
  }
  return text.substr(first, text.find_last_not_of(kBlank) - first + 1);
}

std::vector<std::string> split(std::string_view line) {
  std::vector<std::string> cells;
  while (true) {
    const auto comma = line.find(',');
    cells.emplace_back(trim(line.substr(0, comma)));
    if (comma == std::string_view::npos) {
      return cells;
    }
    line.remove_prefix(comma + 1);
  }
}

}  // namespace

bool parse_number(std::string_view text, double& value) {
  if (!text.empty() && text.front() == '+') {
    text.remove_prefix(1);
  }
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size() && std::isfinite(value);
}

CsvTable read_csv(const std::filesystem::path& file) {
  const std::string content = read_text(file);
  CsvTable table;
  table.file = file.string();
  std::string_view rest = content;
  if (rest.substr(0, 3) == "\xEF\xBB\xBF") {  // byte order mark of some spreadsheets
    rest.remove_prefix(3);
  }
  int line_number = 0;
  while (!rest.empty()) {
    const auto end = rest.find('\n');
    const std::string_view line = trim(rest.substr(0, end));
    rest.remove_prefix(end == std::string_view::npos ? rest.size() : end + 1);
    ++line_number;
    if (line.empty() || line.front() == '#') {
      continue;
    }
    std::vector<std::string> cells = split(line);
    if (table.header.empty()) {
      table.header = std::move(cells);
      continue;
    }
    if (cells.size() > table.header.size()) {
      throw Error({table.file + ":" + std::to_string(line_number), std::to_string(cells.size()) + " columns",
                   "at most the " + std::to_string(table.header.size()) + " of the header"});
    }
    table.rows.push_back(std::move(cells));
    table.lines.push_back(line_number);
  }
  if (table.header.empty()) {
    throw Error({table.file, "an empty file", "a header line and rows"});
  }
  return table;
}

bool CsvTable::has_column(std::string_view name) const {
  return std::find(header.begin(), header.end(), name) != header.end();
}

std::size_t CsvTable::column(std::string_view name) const {
  const auto found = std::find(header.begin(), header.end(), name);
  if (found == header.end()) {
    std::string columns;
    for (const std::string& cell : header) {
      columns += (columns.empty() ? "" : ",") + cell;
    }
    throw Error({file, "columns '" + columns + "'", "a column '" + std::string(name) + "'"});
  }
  return static_cast<std::size_t>(found - header.begin());
}

std::string CsvTable::where(std::size_t row) const { return file + ":" + std::to_string(lines[row]); }

double CsvTable::number(std::size_t row, std::size_t column) const {
  const std::string cell = column < rows[row].size() ? rows[row][column] : std::string();
  double value = 0.0;
  if (!parse_number(cell, value)) {
    throw Error({where(row) + ": column '" + header[column] + "'",
                 cell.empty() ? "nothing" : "'" + cell + "'", "a finite number"});
  }
  return value;
}

std::string format_csv(const std::vector<std::string>& header, const std::vector<std::vector<double>>& rows) {
  std::string text;
  for (std::size_t i = 0; i < header.size(); ++i) {
    text += (i == 0 ? "" : ",") + header[i];
  }
  text += '\n';
  for (const std::vector<double>& row : rows) {
    for (std::size_t i = 0; i < row.size(); ++i) {
      text += (i == 0 ? "" : ",") + shortest(row[i]);
    }
    text += '\n';
  }
  return text;
}

}  // namespace trammel::io
