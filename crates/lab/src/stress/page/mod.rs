//! The catalogue's results as a page: a table, a plot for each case, and pictures of broken claims.

mod plot;
mod show;

use maud::{Markup, html};

use super::{Errors, FLOOR, PicturePair, RunInfo, StressOutcome, StressResult, ValueFinding, range};
use crate::page::marks::sample;
use crate::page::page;
use crate::page::pictures::enlarged;
use afterlight::scene::counted;

/// The page.
pub fn html(run: &RunInfo, verdicts: &[StressResult]) -> String {
    let broken = verdicts.iter().filter(|verdict| !verdict.passes()).count();
    let body = html! {
        p.eyebrow { "Afterlight " (run.version) }
        h1 { "Extreme cases" }
        p {
            (counted(verdicts.len(), "case")) " on " (run.device) ", " (run.driver) ", in " (format!("{:.0} s", run.seconds)) ". "
            @match broken {
                0 => { "All are as claimed." },
                1 => { "One is not as claimed." },
                _ => { (broken) " are not as claimed." },
            }
            @if run.quick { " Only the ends of each sweep, those of its claim and every third value were tried." }
        }
        p.faint {
            "Errors are relative to the brightest channel of each pixel, or to " (format!("{FLOOR:e}"))
            " of the picture's where that is more. Pixels on which raster and truth see different triangles are left out."
        }
        ul.legend {
            li { (sample(plot::WORST, false)) "the worst pixel" }
            li { (sample(plot::MEAN, false)) "the mean" }
            li { "green: what is claimed, up to the bound of the worst pixel" }
        }
        (table(verdicts))
        @for verdict in verdicts { (section(verdict)) }
    };
    page(&format!("Extreme cases: {}", run.device), &body)
}

fn table(verdicts: &[StressResult]) -> Markup {
    html! {
        div.scroll { table {
            thead { tr { th.words { "case" } th { "claimed" } th { "holds" } th { "worst" } th { "mean" } th { "bound" } th { "not finite" } th { "negative" } th.words { "verdict" } } }
            tbody { @for verdict in verdicts {
                tr {
                    td.words { a href=(format!("#{}", uid(verdict))) { (verdict.case.name) } }
                    @for cell in verdict.cells() { td { (cell) } }
                    td.words { (pill(verdict)) }
                }
            } }
        } }
    }
}

fn pill(verdict: &StressResult) -> Markup {
    html! { @if verdict.passes() { span.pill.good { "holds" } } @else { span.pill.bad { "broken" } } }
}

fn section(verdict: &StressResult) -> Markup {
    html! {
        section.case id=(uid(verdict)) {
            h2 { (verdict.case.name) " " (pill(verdict)) }
            p { (verdict.case.extreme) }
            @if let Some(input) = verdict.worst().worst_input { p.faint { "Within the claim it errs most at " (input) "." } }
            @if let Some(plot) = plot::of(verdict) { figure { (plot.draw()) } }
            details open[!verdict.passes()] {
                summary { (verdict.findings.len()) " values" }
                div.scroll { table {
                    thead { tr { th { "value" } th { "worst" } th { "mean" } th { "compared" } th { "elsewhere" } th { "not finite" } th { "negative" } } }
                    tbody { @for finding in &verdict.findings { (row(verdict, finding)) } }
                } }
            }
            @for finding in &verdict.findings { @if let Some(evidence) = &finding.evidence { (pictures(verdict, finding, evidence)) } }
        }
    }
}

fn row(verdict: &StressResult, finding: &ValueFinding) -> Markup {
    let value = range(Some([finding.value; 2]), verdict.case.unit);
    let class = if finding.is_as_claimed(&verdict.case) { "" } else { "bad" };
    html! {
        tr class=(class) {
            td { (value) }
            @match &finding.outcome {
                StressOutcome::Refused(why) => { td.words colspan="6" { "refused: " (why) } },
                StressOutcome::Measured(errors) => {
                    td { (format!("{:.2e}", errors.worst)) }
                    td { (format!("{:.2e}", errors.mean)) }
                    td { (errors.compared) } td { (errors.elsewhere) } td { (errors.not_finite) } td { (errors.negative) }
                },
            }
        }
        @if let StressOutcome::Measured(Errors { worst_input: Some(input), .. }) = &finding.outcome {
            tr { td {} td.words.faint colspan="6" { "worst at " (input) } }
        }
    }
}

fn pictures(verdict: &StressResult, finding: &ValueFinding, evidence: &PicturePair) -> Markup {
    let value = range(Some([finding.value; 2]), verdict.case.unit);
    let shown = show::all(evidence);
    html! {
        figure {
            div.pair { @for (name, source) in &shown {
                (enlarged(name, &format!("picture at {value}"), &format!("{name} at {value}"), source))
            } }
            figcaption { "At " (value) ". Error from black (1e-4 and less) to white (1 and more); red is not finite, blue negative." }
        }
    }
}

fn uid(verdict: &StressResult) -> String {
    verdict.case.name.replace('/', "-")
}

#[cfg(test)]
mod tests {
    use super::super::formula::{WorstInput, inputs};
    use super::super::{Bound, Check, Subject, SweepValues, case};
    use super::*;
    use afterlight::scene::Scene;

    #[test]
    fn a_page_has_each_case_and_pictures_of_what_is_not_as_claimed() {
        let case = case("group/quantity", "what <b>is</b> extreme")
            .over(SweepValues::Decades(0, 1), "m")
            .claim([1.0, 10.0], Bound { worst: 0.5, mean: 0.5 })
            .check(Check::Picture(|_| Subject::new(Scene::default())));
        let evidence = PicturePair { size: [1, 1], drawn: vec![[2.0; 3]], expected: vec![[1.0; 3]] };
        let finding = |value: f64, worst: f64, evidence| ValueFinding {
            value,
            outcome: StressOutcome::Measured(Errors { worst, compared: 1, ..Errors::default() }),
            evidence,
        };
        let mut findings = vec![finding(1.0, 0.1, None), finding(10.0, 1.0, Some(evidence))];
        let input = WorstInput {
            names: &[("roughness <r>", 1)],
            input: inputs::filled([0.5]),
            found: [0.25; 4],
            expected: [1.0; 4],
        };
        let StressOutcome::Measured(errors) = &mut findings[1].outcome else { unreachable!("measured above") };
        errors.worst_input = Some(input);
        let place = RunInfo {
            version: "1".into(),
            device: "a <device>".into(),
            driver: "d".into(),
            quick: false,
            seconds: 1.0,
        };
        let page = html(&place, &[StressResult { case, findings }]);
        assert!(page.contains("One is not as claimed") && page.contains("a &lt;device&gt;"));
        assert!(page.contains("what &lt;b&gt;is&lt;/b&gt; extreme") && page.contains("<svg"));
        assert_eq!(page.matches("data:image/png").count(), 3);
        // The worst input is printed for its value and for the case.
        let worst = "at roughness &lt;r&gt; 0.5, found 0.25 0.25 0.25 0.25, expected 1 1 1 1";
        assert_eq!(page.matches(&format!("errs most {worst}.")).count(), 1);
        assert_eq!(page.matches(&format!("worst {worst}<")).count(), 1);
        assert!(!page.contains("http"));
    }
}
