// SPDX-License-Identifier: Apache-2.0
#include <iostream>
#include <memory>
#include <string>

#include "../io/csv.hpp"
#include "../io/document.hpp"
#include "../io/file.hpp"
#include "../io/filter_file.hpp"
#include "../io/general_filter_file.hpp"
#include "commands.hpp"
#include "filter_general.hpp"
#include "filter_output.hpp"
#include "filter_run.hpp"

namespace trammel::program {

namespace {

struct FilterOptions {
  std::string design;
  std::string data;
  std::string out;
  bool json = false;
};

FilterReport load_report(const std::string& file) {
  return make_filter_report(io::read_filter_file(io::Document::load(file)));
}

int run_design(const FilterOptions& options) {
  const FilterReport report = load_report(options.design);
  std::cout << (options.json ? io::dump(filter_report_json(report)) : filter_report_text(report));
  return kSolved;
}

int run_general(const FilterOptions& options) {
  const io::Document document = io::Document::load(options.design);
  const io::GeneralFilterFile file = io::read_general_filter(document);
  std::cout << io::dump(general_filter_json(file, io::make_general_method(document, file)));
  return kSolved;
}

int run_data(const FilterOptions& options) {
  const FilterReport report = load_report(options.design);
  const io::CsvTable table = io::read_csv(options.data);
  const auto columns = run_filter(report, table);
  if (options.out.empty() && !options.json) {
    std::cout << format_filtered(table, columns);
    return kSolved;
  }
  if (!options.out.empty()) {
    io::write_atomically(options.out, format_filtered(table, columns));
  }
  if (options.json) {
    io::Json json = {{"rows", table.rows.size()}, {"columns", io::Json::array()}};
    for (const FilteredColumn& column : columns) {
      io::Json counts = io::Json::object();
      for (const filter::SampleUse use : column.use) {
        const std::string name(to_string(use));
        counts[name] = counts.value(name, 0) + 1;
      }
      io::Json estimate = io::Json::array();
      for (const double value : column.estimates.back()) {
        estimate.push_back(io::to_json(value));
      }
      json["columns"].push_back({{"name", column.name}, {"use", counts}, {"final_estimate", estimate}});
    }
    std::cout << io::dump(json);
  }
  return kSolved;
}

}  // namespace

void add_filter_command(CLI::App& app, Action& action) {
  CLI::App* command = app.add_subcommand(
      "filter", "design and run invariant filters (alpha-beta, alpha-beta-gamma, any order)");
  command->require_subcommand(1);
  const auto options = std::make_shared<FilterOptions>();

  CLI::App* design = command->add_subcommand("design", "synthesise and analyse a filter");
  design->add_option("SPEC", options->design, "design file, .toml or .json")->required();
  design->add_flag("--json", options->json, "print the result as JSON");
  design->footer(io::filter_file_help());
  design->callback([options, &action] { action = [options] { return run_design(*options); }; });

  CLI::App* general =
      command->add_subcommand("general", "solve the general method for matrices A and B or S; prints JSON");
  general->add_option("SPEC", options->design, "matrices file, .toml or .json")->required();
  general->add_flag("--json", options->json, "accepted for likeness: the result is always JSON");
  general->footer(io::general_filter_help());
  general->callback([options, &action] { action = [options] { return run_general(*options); }; });

  CLI::App* run = command->add_subcommand("run", "filter a table of coordinates");
  run->add_option("SPEC", options->design, "design file, .toml or .json")->required();
  run->add_option("DATA", options->data,
                  "CSV with a column t_s and one column per coordinate; empty cells are missing samples")
      ->required();
  run->add_option("--out", options->out, "CSV file to write instead of printing it");
  run->add_flag("--json", options->json, "print a summary as JSON");
  run->footer(io::filter_file_help());
  run->callback([options, &action] { action = [options] { return run_data(*options); }; });
}

}  // namespace trammel::program
